"""Labels a mesh by the commands of docs/label.md, in their order, with requests in place of a browser."""

import json
import re
import shlex
import signal
import subprocess
import urllib.error
import urllib.request
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


def label(command):
    """Labels as a person who accepts every proposal, and says that every room is an office."""
    serving = subprocess.Popen([*command, "--no-open"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    address = serving.stdout.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/", address), serving.communicate()

    proposed = asked(address, "structure.json")
    everything = {"surfaces": list(range(len(proposed["surfaces"]))), "rooms": list(range(len(proposed["rooms"])))}
    state = asked(address, "gesture", {"revision": 0, "gesture": {"accept": everything}})["state"]
    for room in state["rooms"]:
        gesture = {"room": {"room": room["number"], "is": {**room["is"], "kind": "office"}}}
        state = asked(address, "gesture", {"revision": state["revision"], "gesture": gesture})["state"]

    serving.send_signal(signal.SIGINT)
    _, log = serving.communicate(timeout=60)
    assert serving.returncode == 0, log
    return state


def test_the_evening(s3d, demo, tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    # A scan as an app writes it: GLB, +Y up, without a name for anything.
    trimesh.load(demo / "scan" / "rgb.obj", force="mesh").export("scan.glb")

    state = None
    for words in lines():
        if words == ["s3d", "label", "scan.glb"]:
            state = label([s3d.binary, *words[1:]])
        elif words[1] == "export":
            s3d(*words[1:], "--views", "2", "--size", "64", "--pano-width", "128", "--points-per-m2", "50")
        else:
            s3d(*words[1:])

    labels = np.load("scan.labels/labels.npz")
    assert (labels["instance"] >= 0).mean() > 0.1 and len(state["rooms"]) == len(labels["rooms"])
    instances = json.loads((tmp_path / "dataset/area_1/3d/instances.json").read_text())["instances"]
    assert {instance["class"] for instance in instances} == {"floor", "ceiling", "wall"}
    assert {instance["room"] for instance in instances} == set(labels["room_names"])
    assert (tmp_path / "dataset_report/index.html").is_file()
    for made in ["scan_labelled.ply", "scan_scannet", "scan_scannetpp", "scan_s3dis"]:
        assert (tmp_path / made).exists(), made
