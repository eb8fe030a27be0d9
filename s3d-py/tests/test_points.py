"""Points sampled from a mesh, and voting for its faces."""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing.queues import SimpleQueue
from pathlib import Path

import numpy as np
import pytest

import s3d_py as s3d


def test_samples_lie_evenly_on_the_surface(room: s3d.Mesh) -> None:
    cloud = s3d.sample(room, 500, seed=3)
    assert (
        len(cloud) == 30_000 == len(cloud.rgb) == len(cloud.face)
        and repr(cloud) == "PointCloud(30,000 points)"
    )
    counts = np.bincount(cloud.face, minlength=14)
    assert np.abs(counts - 500 * room.face_areas).max() <= 2
    # The points lie in the planes of their faces and have their colours.
    corner = room.vertices[room.faces[cloud.face, 0]]
    assert np.abs(((cloud.xyz - corner) * room.face_normals[cloud.face]).sum(-1)).max() < 1e-6
    assert room.vertex_colors is not None
    assert np.array_equal(cloud.rgb, room.vertex_colors[room.faces[cloud.face, 0]])
    for threads in (1, 3):
        again = s3d.sample(room, 500, seed=3, threads=threads)
        assert np.array_equal(again.xyz, cloud.xyz)
    assert not np.array_equal(s3d.sample(room, 500, seed=4).xyz, cloud.xyz)
    assert len(s3d.sample(room, points=7)) == 7 and len(s3d.sample(room, points=0)) == 0
    for wrong in (-1.0, np.inf, np.nan):
        with pytest.raises(s3d.UsageError, match="points_per_m2"):
            s3d.sample(room, wrong)
    with pytest.raises(s3d.UsageError, match="points=-1"):
        s3d.sample(room, points=-1)


def test_points_vote_for_the_nearest_face(room: s3d.Mesh) -> None:
    cloud = s3d.sample(room, 200, seed=1)
    labels = cloud.face.astype(np.int64) // 2
    labels[::20] = 6  # one in twenty is wrong
    votes = s3d.vote(room, cloud, labels)
    assert np.array_equal(votes.label, np.arange(14) // 2)
    assert votes.total.sum() == len(cloud) and (votes.votes + votes.runner_up_votes == votes.total).all()
    assert np.array_equal(votes.margin, votes.votes - votes.runner_up_votes)
    assert votes.runner_up[:12].tolist() == [6] * 12 and votes.runner_up[12:].tolist() == [-1] * 2
    assert votes.share == pytest.approx(votes.votes / votes.total) and votes.share[:12].max() < 0.96
    assert votes.max_distance.max() < 1e-6 and (votes.mean_distance <= votes.max_distance).all()
    assert repr(votes) == "Votes(14 of 14 faces labelled, 7 labels)"


def test_faces_without_votes_have_none_and_can_be_filled(room: s3d.Mesh) -> None:
    votes = s3d.vote(room, [[0.5, 1.4, 0.01], [3.5, 1.0, 2.4]], [3, 0])
    labelled = np.flatnonzero(votes.label >= 0)
    assert len(labelled) == 2 and sorted(votes.label[labelled].tolist()) == [0, 3]
    empty = votes.label < 0
    assert (
        (votes.total[empty] == 0).all()
        and np.isnan(votes.mean_distance[empty]).all()
        and np.isnan(votes.share[empty]).all()
    )
    # Fills the other half of the floor and of the ceiling, but not around the edges to the walls.
    filled = votes.filled(within=10)
    assert (filled[:2] == 3).all() and (filled[2:4] == 0).all() and (filled[4:] == -1).all()
    assert np.array_equal(votes.filled(within=0), votes.label)
    with pytest.raises(s3d.UsageError, match="within=NaN"):
        votes.filled(within=float("nan"))
    with pytest.raises(s3d.UsageError, match="3 labels for 14 faces"):
        s3d.fill(room, [1, 2, 3], 1.0)


def test_columns_of_other_packages_are_taken(room: s3d.Mesh) -> None:
    points = np.array([[0.5, 1.4, 0.01], [3.5, 1.0, 2.4]])
    expected = s3d.vote(room, points, [3, 0]).label

    class Las(dict[str, object]):
        """Has the attributes of laspy's points."""

        xyz = points

    assert np.array_equal(
        s3d.vote(room, Las(classification=np.array([3, 0], np.uint8)), "classification").label, expected
    )
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(points, columns=["x", "y", "z"])
    frame["class"] = [3, 0]
    assert np.array_equal(s3d.vote(room, frame, "class").label, expected)


def test_wrong_points_are_told(room: s3d.Mesh) -> None:
    point = [[1.0, 1.0, 1.0]]
    for labels, words in (
        ([-1], "labels[0] is -1"),
        ([900_000], "labels[0] is 900000"),
        ([1.5], "whole numbers"),
        ([1, 2], "2 labels for 1 points"),
        ([[1]], "shape (N,)"),
    ):
        with pytest.raises(s3d.UsageError) as caught:
            s3d.vote(room, point, labels)
        assert words in str(caught.value)
    with pytest.raises(s3d.InputError, match="point 0"):
        s3d.vote(room, [[np.nan, 0, 0]], [1])
    with pytest.raises(s3d.UsageError, match="xyz: an array"):
        s3d.vote(room, [[1.0, 2.0]], [1])


def _count(mesh: s3d.Mesh, queue: SimpleQueue[int]) -> None:
    queue.put(len(s3d.sample(mesh, points=50_000)))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own(room: s3d.Mesh) -> None:
    assert len(s3d.sample(room, points=50_000)) == 50_000
    context = multiprocessing.get_context("fork")
    queue: SimpleQueue[int] = context.SimpleQueue()
    child = context.Process(target=_count, args=(room, queue))
    child.start()
    child.join(60)
    assert child.exitcode == 0 and queue.get() == 50_000


def test_annotated_points_are_those_of_the_files(demo: Path) -> None:
    folder = demo / "scan" / "Area_1"
    points = s3d.read_points(folder)
    files = sorted(folder.glob("*/Annotations/*.txt"))
    assert len(points.names) == len(files) and len(points) == len(points.rgb) == len(points.label)
    for path in files[:: len(files) // 7]:
        class_name, number = path.stem.rsplit("_", 1)
        name = f"{class_name}_{number}_{path.parents[1].name}"
        rows = np.loadtxt(path)
        of_instance = points.label == points.names.index(s3d.NameInRoom(name))
        assert np.allclose(points.xyz[of_instance], rows[:, :3], atol=1e-6)
        assert np.array_equal(points.rgb[of_instance], rows[:, 3:6])
    # A data set has the points by room as well.
    exported = s3d.read_points(demo / "s3dis" / "Area_1")
    labels = [label for label in s3d.open(demo).labels if label.class_name]
    # Instances are numbered by room here, and by area in the data set.
    parts = [name.split("_") for name in exported.names]
    assert sorted((words[0], "_".join(words[2:])) for words in parts) == sorted(
        (str(label.class_name), label.room) for label in labels
    )
    with pytest.raises(s3d.MissingFileError):
        s3d.read_points(demo / "nothing.ply")
    with pytest.raises(s3d.UsageError, match="smell"):
        s3d.read_points(folder, taxonomy="smell")
    assert "instances" in repr(points)


def test_annotated_points_are_saved_and_read_again(demo: Path, tmp_path: Path) -> None:
    points = s3d.read_points(demo / "scan" / "Area_1")
    path = tmp_path / "points.npz"
    points.save(path)
    again = s3d.read_points(path, room_column="room")
    assert set(again.names) == set(points.names) and len(again) == len(points)
    for name in points.names[::9]:
        of_name = [cloud.label == cloud.names.index(name) for cloud in (points, again)]
        assert np.array_equal(points.xyz[of_name[0]], again.xyz[of_name[1]])
        assert np.array_equal(points.rgb[of_name[0]], again.rgb[of_name[1]])

    some, label = points.xyz[:2], [0, 1]
    refused: list[tuple[str, list[str], str]] = [
        ("points.ply", [*points.names], "only as .npz"),
        ("other.npz", ["chair"], "chair_1_office_2"),
        ("other.npz", ["chair_1_office_2"], "from 0 to 1 for 1 names"),
    ]
    for wrong, names, match in refused:
        with pytest.raises(s3d.UsageError, match=match):
            s3d.save_points(tmp_path / wrong, some, None, label, names=names)
    assert [file.name for file in tmp_path.iterdir()] == ["points.npz"]

    # What labels without names mean must be said, and the message tells how here.
    s3d.save_points(path, some, None, label)
    with pytest.raises(s3d.FileError, match="`class_column`"):
        s3d.read_points(path, room="office_1")


def test_tables_of_points_tell_their_columns(tmp_path: Path) -> None:
    table = np.array([[0, 0, 0, 8, 1], [1, 0, 0, 8, 2], [0, 1, 0, 1, 1]], np.float32)
    np.save(tmp_path / "points.npy", table)

    def read(classes: dict[str, str | None], offset: float = 0.0) -> s3d.AnnotatedPoints:
        return s3d.read_points(
            tmp_path / "points.npy",
            columns=["x", "y", "z", "class", "instance"],
            classes=classes,
            room="office_3",
            offset=(offset, 0, 0),
        )

    points = read({"8": "chair", "1": "floor"}, offset=1)
    assert sorted(points.names) == ["chair_1_office_3", "chair_2_office_3", "floor_1_office_3"]
    assert points.xyz[:, 0].min() == -1 and (points.rgb == 0).all()
    assert read({"8": "table", "1": None}).names == ["table_1_office_3", "table_2_office_3"]
    with pytest.raises(s3d.UsageError, match="smell"):
        read({"8": "smell"})
    with pytest.raises(s3d.FormatError, match="points.npy"):
        read({"8": "chair"})


def test_points_are_saved_as_ply(room: s3d.Mesh, tmp_path: Path) -> None:
    cloud = s3d.sample(room, 20, seed=1)
    cloud.save(tmp_path / "cloud.ply")
    content = (tmp_path / "cloud.ply").read_bytes()
    header, _, body = content.partition(b"end_header\n")
    assert f"element vertex {len(cloud)}".encode() in header
    rows = np.frombuffer(body, [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    assert np.array_equal(rows["xyz"], cloud.xyz) and np.array_equal(rows["rgb"], cloud.rgb)
    s3d.save_points(tmp_path / "cloud.ply", [[0, 0, 1]], [[1.0, 0.0, 0.5]])
    assert (tmp_path / "cloud.ply").read_bytes().endswith(bytes([255, 0, 128]))
    with pytest.raises(s3d.UsageError, match="colours"):
        s3d.save_points(tmp_path / "cloud.ply", cloud.xyz, cloud.rgb[1:])


def test_points_of_laspy_vote(room: s3d.Mesh) -> None:
    laspy = pytest.importorskip("laspy", reason="laspy is not installed")
    cloud = s3d.sample(room, 50, seed=2)
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.header.scales = [0.001] * 3
    las.x, las.y, las.z = cloud.xyz.T
    las.classification = (cloud.face // 2).astype(np.uint8)
    assert np.array_equal(s3d.vote(room, las, "classification").label, np.arange(14) // 2)
