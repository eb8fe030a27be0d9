"""Exports scene files and meshes in memory, and resumes stopped exports."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d

SMALL: s3d.ExportOptions = {"views": 4, "size": 64, "pano_width": 128, "points_per_m2": 50.0}
SEEDED: s3d.ExportOptions = {**SMALL, "seed": 1}
WORDS = ["--views", "4", "--size", "64", "--pano-width", "128", "--points-per-m2", "50"]
NAMES = ["floor_1", "ceiling_1", "wall_1", "wall_2", "wall_3", "wall_4", "table_1"]


def bytes_of(folder: Path) -> dict[str, str]:
    """Returns checksums of all files. Of these only the manifest depends on the place of the input."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def manifest(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "manifest.json").read_text())
    return read


def test_scene_files_make_what_the_command_makes(demo: Path, tmp_path: Path) -> None:
    scene = demo / "scan" / "scene.toml"
    summary = s3d.export(scene, tmp_path / "ours", threads=2, **SMALL)
    assert (
        summary is not None
        and summary["areas"] == 1
        and summary["locations"] == summary["panoramas"]["images"]
    )
    command = [
        sys.executable,
        "-m",
        "s3d_py",
        "export",
        str(scene),
        "-o",
        str(tmp_path / "theirs"),
        "--quiet",
        *WORDS,
    ]
    subprocess.run(command, check=True)
    assert bytes_of(tmp_path / "ours") == bytes_of(tmp_path / "theirs")
    # Called again, there is nothing left to do.
    assert s3d.export(scene, tmp_path / "ours", **SMALL) is None
    with pytest.raises(s3d.UsageError, match="ours"):
        s3d.export(scene, tmp_path / "ours", **SEEDED)
    assert s3d.export(scene, tmp_path / "ours", overwrite=True, **SEEDED) is not None
    assert manifest(tmp_path / "ours")["seed"] == 1


def test_scenes_are_packed_like_their_data_set(demo: Path, room: s3d.Mesh, tmp_path: Path) -> None:
    scene = demo / "scan" / "scene.toml"
    s3d.export(scene, tmp_path / "dataset", **SMALL)
    s3d.open(tmp_path / "dataset").pack("webdataset", tmp_path / "packed")
    summary = s3d.export(scene, tmp_path / "shards", to="webdataset", **SMALL)
    assert summary is not None and summary["files"] == len(bytes_of(tmp_path / "shards"))
    assert bytes_of(tmp_path / "shards") == bytes_of(tmp_path / "packed")
    # A mesh in memory likewise.
    place = s3d.look_at((2, 1.5, 1.2), (3, 1.5, 1.2))
    assert s3d.export(room, tmp_path / "of_memory", locations=[place], to="huggingface", **SMALL) is not None
    assert (tmp_path / "of_memory" / "croissant.json").exists()
    for kind, message in [("zip", "to=.zip.: must be one of webdataset"), ("coco", "to=.*coco.*made from a data set")]:
        with pytest.raises(s3d.UsageError, match=message):
            s3d.export(scene, tmp_path / "none", to=kind, **SMALL)
    assert not (tmp_path / "none").exists()


def test_a_labelled_mesh_in_memory_makes_a_data_set(room: s3d.Mesh, tmp_path: Path) -> None:
    names = [f"{name}_office_1" for name in NAMES]
    of_face = np.arange(14) // 2
    place = s3d.Location("0123456789abcdef" * 2, s3d.look_at((2, 1.5, 1.4), (2, 3, 1.4)))
    told: list[s3d.Task] = []
    by_place = s3d.export(
        room, tmp_path / "a", locations=[place], labels=(names, of_face), progress=told.append, **SMALL
    )
    assert by_place and by_place["locations"] == 1 and by_place["panoramas"]["images"] == 1 and told
    table = json.loads((tmp_path / "a" / "assets" / "semantic_labels.json").read_text())
    assert {f"{name}_1" for name in names} <= set(table)
    pose = json.loads(next((tmp_path / "a" / "area_1" / "pano" / "pose").iterdir()).read_text())
    assert pose["camera_uuid"] == place.uuid and pose["camera_location"] == [2, 1.5, 1.4]
    assert np.array(pose["camera_rt_matrix"]) == pytest.approx(
        np.linalg.inv(place.T_world_cam)[:3], abs=1e-12
    )
    # One name for each face gives the same data set, and so does an Area.
    by_name = np.array(names)[of_face]
    area = s3d.Area(room, locations=[place], labels=by_name)
    assert s3d.export([area], tmp_path / "b", **SMALL) is not None
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b")


def test_labels_may_belong_to_the_file_of_a_mesh(tmp_path: Path) -> None:
    path = tmp_path / "floor.obj"
    path.write_text("v 0 0 0\nv 4 0 0\nv 4 0 -4\nv 0 0 -4\nf 1 2 3\nf 1 3 4\n")
    labels = np.array(["floor_1_office_1", ""])
    summary = s3d.export(
        path,
        tmp_path / "out",
        locations=[(2, 2, 1.5)],
        labels=labels,
        allow=["labels", "colour", "coverage", "up", "scale", "inside-out"],
        **SMALL,
    )
    assert summary and summary["locations"] == 1
    names = json.loads((tmp_path / "out" / "assets" / "semantic_labels.json").read_text())
    assert "floor_1_office_1_1" in names


def test_a_mesh_alone_gets_the_locations_that_are_placed(room: s3d.Mesh, tmp_path: Path) -> None:
    placed = s3d.Scene(room).place_cameras()
    alone = s3d.export(room, tmp_path / "alone", **SMALL)
    assert alone and alone["locations"] == len(placed)
    s3d.export(room, tmp_path / "given", locations=placed, **SMALL)
    images = [
        {p.name: p.read_bytes() for p in (tmp_path / name / "area_1" / "pano" / "rgb").iterdir()}
        for name in ("alone", "given")
    ]
    assert images[0] == images[1] and len(images[0]) == len(placed)


def test_several_areas_are_one_data_set(room: s3d.Mesh, tmp_path: Path) -> None:
    areas = [s3d.Area(room, number, locations=[(2.0, 1.5, 1.0 + number / 10)]) for number in (1, 3)]
    summary = s3d.export(areas, tmp_path / "two", **SMALL)
    assert summary and summary["areas"] == 2 and (tmp_path / "two" / "area_3" / "pano").is_dir()


def test_wrong_calls_are_told(room: s3d.Mesh, tmp_path: Path) -> None:
    out = tmp_path / "out"
    calls: list[tuple[Any, dict[str, Any], type[Exception], str]] = [
        (room, {"vistas": 3}, s3d.UsageError, "unknown field `vistas`"),
        (room, {"views": -1}, s3d.UsageError, "-1"),
        (room, {"size": 3}, s3d.UsageError, "size: must be from 8 to 16384"),
        (room, {"modalities": ["smell"]}, s3d.UsageError, "smell"),
        (room, {"allow": ["all"]}, s3d.UsageError, "colour, coverage"),
        (room, {"labels": (["throne_1_office_1"], [0] * 14)}, s3d.UsageError, "throne"),
        (room, {"labels": (["chair_1_office_1"], [0] * 13)}, s3d.UsageError, "13 labels for 14 faces"),
        (room, {"labels": (["chair_1_office_1"], [1] * 14)}, s3d.UsageError, "face 0 has 1"),
        (room, {"labels": [""] * 14}, s3d.FormatError, "labels no face"),
        (s3d.Area(room, taxonomy="kitti", labels=["chair_1_office_1"] * 14), {}, s3d.UsageError, "taxonomy"),
        (s3d.Area(room, 0), {}, s3d.InputError, "areas count from 1"),
        ([room, room], {"locations": [(1, 1, 1)]}, s3d.UsageError, "of a single mesh"),
        (["gone.toml", room], {}, s3d.UsageError, "either all paths"),
        ("gone.toml", {}, s3d.MissingFileError, "gone.toml"),
        (room, {"locations": [s3d.Location("me", np.eye(4))]}, s3d.InputError, "uuid"),
    ]
    for scene, arguments, error, words in calls:
        changed: dict[str, Any] = dict(SMALL) | arguments
        with pytest.raises(error) as caught:
            s3d.export(scene, out, **changed)
        assert words in str(caught.value), (arguments, str(caught.value))
    assert not out.exists() or not any(out.rglob("*.png"))


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_stops_an_export_and_the_same_call_goes_on(demo: Path, tmp_path: Path) -> None:
    program = textwrap.dedent(
        """
        import sys
        import s3d_py as s3d

        def tell(task):
            if task.what == "rendering" and task.done:
                print(task.done, flush=True)

        out, views = sys.argv[2], int(sys.argv[3])
        try:
            s3d.export(sys.argv[1], out, views=views, size=320, pano_width=512, points_per_m2=50.0, threads=1,
                       progress=tell)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            sys.exit(7)
        """
    )
    scene, out, whole = demo / "scan" / "scene.toml", tmp_path / "stopped", tmp_path / "whole"
    command = [sys.executable, "-c", program, str(scene)]
    stopped = subprocess.Popen([*command, str(out), "24"], stdout=subprocess.PIPE, text=True)
    assert stopped.stdout and stopped.stdout.readline()
    stopped.send_signal(signal.SIGINT)
    told = stopped.communicate(timeout=120)[0].split()
    assert stopped.returncode == 7 and told[-1] == "interrupted"
    before = [path for path in out.rglob("*.png")]
    assert before and not (out / "files.csv").exists()
    subprocess.run([*command, str(out), "24"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([*command, str(whole), "24"], check=True, stdout=subprocess.DEVNULL)
    assert bytes_of(out) == bytes_of(whole)
