"""Labels a mesh by the commands of docs/label.md, in their order, with requests in place of a browser."""

import json
import re
import shlex
import signal
import subprocess
import urllib.error
import urllib.request
from contextlib import contextmanager
from time import sleep

import numpy as np
import pytest
from conftest import ROOT


def lines():
    """The commands of the page, without comments."""
    text = (ROOT / "docs" / "label.md").read_text()
    blocks = re.findall(r"^```sh\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    return [shlex.split(line, comments=True) for block in blocks for line in block.splitlines()]


def asked(address, name, wish=None):
    """What the server answers; it is asked again while it says that it is busy."""
    for _ in range(600):
        try:
            body = None if wish is None else json.dumps(wish).encode()
            with urllib.request.urlopen(address + name, body) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as e:
            assert e.code == 503, e.read()
            sleep(0.1)
    raise AssertionError(f"{name} is busy for a minute")


@contextmanager
def served(command):
    """The address of the page, while it is served."""
    serving = subprocess.Popen([*command, "--no-open"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    address = serving.stdout.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/", address), serving.communicate()

    yield address
    serving.send_signal(signal.SIGINT)
    _, log = serving.communicate(timeout=60)
    assert serving.returncode == 0, log


def label(address):
    """Labels as a person who accepts every proposal, and says that every room is an office."""
    proposed = asked(address, "structure.json")
    everything = {"surfaces": list(range(len(proposed["surfaces"]))), "rooms": list(range(len(proposed["rooms"])))}
    state = asked(address, "gesture", {"revision": 0, "gesture": {"accept": everything}})["state"]
    for room in state["rooms"]:
        gesture = {"room": {"room": room["number"], "is": {**room["is"], "kind": "office"}}}
        state = asked(address, "gesture", {"revision": state["revision"], "gesture": gesture})["state"]
    return state


def predict(dataset):
    """Writes what a perfect network would say of the views: their classes."""
    prediction = dataset / "prediction"
    prediction.mkdir()
    for image in (dataset / "semantic_class").iterdir():
        (prediction / image.name.replace("_semantic_class", "_prediction")).write_bytes(image.read_bytes())


def test_the_evening(s3d, demo, tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    # A scan as an app writes it: GLB, +Y up, without a name for anything.
    trimesh.load(demo / "scan" / "rgb.obj", force="mesh").export("scan.glb")

    state, proposed = None, None
    for words in lines():
        # Tests of s3d-annotate have masks of photographs, and the scan of another day.
        if "masks/" in words or "--carry-over" in words:
            continue
        if words == ["s3d", "label", "scan.glb"]:
            with served([s3d.binary, *words[1:]]) as address:
                state = label(address)
        elif "--proposals" in words:
            predict(tmp_path / "dataset" / "area_1" / "data")
            with served([s3d.binary, *words[1:]]) as address:
                proposed = asked(address, "structure.json")
        elif words[1] == "export":
            small = ["--views", "2", "--size", "64", "--pano-width", "128", "--points-per-m2", "50"]
            s3d(*words[1:], *small, "--modalities", "rgb,depth,semantic,semantic_class,pose")
        else:
            s3d(*words[1:])

    guessed = [surface for surface in proposed["surfaces"] if surface["source"].startswith("prediction")]
    assert guessed and {surface["class"] for surface in guessed} <= {"floor", "ceiling", "wall"}, proposed
    labels = np.load("scan.labels/labels.npz")
    assert (labels["instance"] >= 0).mean() > 0.1 and len(state["rooms"]) == len(labels["rooms"])
    instances = json.loads((tmp_path / "dataset/area_1/3d/instances.json").read_text())["instances"]
    assert {instance["class"] for instance in instances} == {"floor", "ceiling", "wall"}
    assert {instance["room"] for instance in instances} == set(labels["room_names"])
    assert (tmp_path / "dataset_report/index.html").is_file()
    for made in ["scan_labelled.ply", "scan_scannet", "scan_scannetpp", "scan_s3dis"]:
        assert (tmp_path / made).exists(), made
