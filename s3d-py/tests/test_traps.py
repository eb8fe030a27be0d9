"""Calls that once put data on its side, cut numbers, or ended the interpreter."""

from __future__ import annotations

import logging
import pickle
import resource
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d

from common import AHEAD, K, box

TRIANGLE: dict[str, Any] = dict(vertices=np.eye(3), faces=[[0, 1, 2]])


@pytest.fixture(scope="module")
def lying(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A room with Z up, 6 × 5 × 2.5 m, as files whose axes and units differ."""
    folder = tmp_path_factory.mktemp("axes")
    room = box((6.0, 5.0, 2.5))
    lying = room.vertices[:, [0, 2, 1]] * [1, 1, -1]
    forms: dict[str, Any] = {"z": room.vertices, "y": lying, "mm": room.vertices * 1000}
    for name, vertices in forms.items():
        lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c}" for a, b, c in room.faces + 1]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    return {name: folder / f"{name}.obj" for name in forms}


def test_every_door_finds_the_same_up_axis_and_unit(lying: dict[str, Path]) -> None:
    for path in lying.values():
        doors: list[s3d.Mesh] = [
            s3d.read_mesh(path),
            s3d.as_mesh(path),
            s3d.Scene(path).mesh,
            s3d.vote(path, [[2, 1.5, 0]], [3]).mesh,
        ]
        for mesh in doors:
            assert np.allclose(mesh.bounds[1] - mesh.bounds[0], [6, 5, 2.5], atol=1e-5), path
        cloud = s3d.sample(path, points=4000)
        assert np.allclose(np.ptp(cloud.xyz, 0), [6, 5, 2.5], atol=0.1)


def test_an_axis_is_told_and_a_wish_that_contradicts_is_warned_of(
    lying: dict[str, Path], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, "s3d_py"):
        s3d.read_mesh(lying["z"])
    assert any("+Z is taken for up" in record.getMessage() for record in caplog.records)
    assert not any(record.levelno >= logging.WARNING for record in caplog.records)
    caplog.clear()
    on_its_side = s3d.read_mesh(lying["z"], up="y")
    assert np.allclose(np.ptp(on_its_side.vertices, 0), [6, 2.5, 5])
    warnings = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
    assert len(warnings) == 1 and "z.obj" in warnings[0] and "on its side" in warnings[0]


def test_exports_of_a_mesh_take_axes_with_and_without_locations(lying: dict[str, Path], tmp_path: Path) -> None:
    small: Any = {"views": 1, "size": 32, "pano_width": 64, "points_per_m2": 20.0}
    place = s3d.look_at((2, 1.5, 1.5), (4, 1.5, 1.5))
    doors: list[tuple[str, Any]] = [
        ("z", {}),
        ("z", {"up": "z"}),
        ("z", {"locations": [place]}),
        ("y", {"locations": [place]}),
        ("mm", {"units": "mm", "locations": [place]}),
    ]
    for name, options in doors:
        out = tmp_path / f"{name}_{len(list(tmp_path.iterdir()))}"
        s3d.export(lying[name], out, allow=["coverage", "colour"], **options, **small)
        size = np.ptp(s3d.open(out).mesh().vertices, 0)
        assert np.allclose(size, [6, 5, 2.5], atol=1e-4), (name, options, size)
    with pytest.raises(s3d.UsageError, match="up, units"):
        s3d.export(box(), tmp_path / "memory", up="z")


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are Linux's")
@pytest.mark.parametrize(
    "call",
    [
        "s3d.sample(box(), 1e15)",
        "s3d.sample(box(), points=10**12)",
        "s3d.Scene(box()).render(s3d.intrinsics((20000, 20000), 60), AHEAD, (20000, 20000))",
        "s3d.Scene(box()).panorama((2, 1.5, 1.2), 32768, modalities=['xyz', 'normal', 'rgb'])",
    ],
)
def test_what_does_not_fit_into_memory_is_an_error(call: str) -> None:
    program = f"""
        import s3d_py as s3d
        from common import AHEAD, box
        try:
            {call}
        except MemoryError as error:
            print(type(error).__name__, error)
    """
    found = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30)),
    )
    assert found.returncode == 0 and found.stdout.startswith("TooLargeError"), found
    assert "GiB of memory" in found.stdout


def test_an_export_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(s3d.UsageError, match="scene"):
        s3d.export([], tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"vertex_colors": np.full((3, 3), 60_000, np.uint16)}, "vertex_colors: .*uint16 from 60000 to 60000"),
        ({"vertex_colors": np.full((3, 3), 1.5)}, "float64 from 1.5 to 1.5"),
        ({"vertex_colors": [[0, 0, -1]] * 3}, "int64 from -1 to 0"),
        ({"vertex_colors": np.full((3, 3), np.nan)}, "nan"),
        ({"texture": np.full((4, 4, 3), 255.0), "uv": np.eye(3)[:, :2]}, "texture: .*float64 from 255 to 255"),
        ({"texture": np.zeros((4, 4, 2), np.uint8), "uv": np.eye(3)[:, :2]}, "texture: an image"),
        ({"texture_of_face": [0.5]}, "texture_of_face: whole numbers"),
        ({"face_colors": [[1, 2, 3]] * 2}, "2 face_colors for 1 faces"),
        ({"face_colors": [[1, 2, 3]], "vertex_colors": np.eye(3)}, "give one of them"),
    ],
)
def test_arrays_that_do_not_fit_are_refused_with_what_was_seen(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(s3d.UsageError, match=words):
        s3d.Mesh(**TRIANGLE, **arguments)


def test_floats_mean_the_same_for_colours_and_textures() -> None:
    corners, faces = [[0, 5, 0], [4, 5, 0], [4, 5, 4], [0, 5, 4]], [[0, 1, 2], [0, 2, 3]]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    view, k = s3d.look_at((2, 0, 2), (2, 5, 2)), s3d.intrinsics((32, 32), 40)
    for look in (
        {"vertex_colors": np.full((4, 3), 0.5)},
        {"face_colors": np.full((2, 4), 0.5)},
        {"face_colors": [[128, 128, 128]] * 2},
        {"uv": uv, "texture": np.full((8, 8, 3), 0.5, np.float32)},
        {"uv": uv, "texture": np.full((8, 8, 4), 128, np.uint8)},
    ):
        arguments: dict[str, Any] = look
        scene = s3d.Scene(s3d.Mesh(corners, faces, **arguments))
        assert (scene.render(k, view, (32, 32), modalities=["rgb"]).rgb == 128).all(), look


def test_labels_are_whole_numbers(tmp_path: Path) -> None:
    room = box()
    with pytest.raises(s3d.UsageError, match="labels: whole numbers, not float64 from 0.7 to 0.7"):
        s3d.fill(room, np.full(14, 0.7), 1.0)
    with pytest.raises(s3d.UsageError, match="labels: whole numbers"):
        s3d.export(room, tmp_path / "out", labels=(["wall_1_office_1"], np.full(14, 0.7)))


def test_colours_of_trimesh_faces_and_materials_are_kept() -> None:
    trimesh = pytest.importorskip("trimesh")
    view, k = s3d.look_at((0, -5, 0), (0, 0, 0)), s3d.intrinsics((16, 16), 5)

    def seen(mesh: Any) -> list[int]:
        rgb = s3d.Scene(mesh).render(k, view, (16, 16), modalities=["rgb"]).rgb
        return rgb[8, 8].tolist()  # type: ignore[no-any-return]

    cube = trimesh.creation.box((1, 1, 1))
    cube.visual.face_colors = np.tile(np.array([9, 80, 7, 255], np.uint8), (12, 1))
    assert seen(cube) == [9, 80, 7]
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[200, 100, 50, 255])
    uv = np.zeros((8, 2))
    cube.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    assert seen(cube) == [200, 100, 50]
    image = pytest.importorskip("PIL.Image").new("RGB", (4, 4), (255, 51, 255))
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 255, 51, 255], baseColorTexture=image)
    cube.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    assert seen(cube) == [255, 51, 51]


def test_an_image_is_itself(demo: Path) -> None:
    data = s3d.open(demo)
    assert data[3] == data[3] and data.index(data[3]) == 3 and len({data[3], data[3], data[4]}) == 2
    assert data[3] != data[4] and data[3] != "data[3]" and s3d.open(demo)[3] == data[3]


def test_one_class_of_error_for_no_data_set(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path, tmp_path / "gone", tmp_path / "file"):
        calls: list[Any] = [
            s3d.open,
            s3d.verify,
            lambda f: s3d.compare(f, f),
            lambda f: s3d.evaluate("sem-view", f, f),
        ]
        for call in calls:
            with pytest.raises(s3d.NoDataSetError, match="no data set is there") as caught:
                call(folder)
            assert isinstance(caught.value, s3d.UsageError) and isinstance(caught.value, FileNotFoundError)


def test_messages_are_for_people(tmp_path: Path) -> None:
    scene = s3d.Scene(box())
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"rgb_samples": "2"}, "rgb_samples='2': must be a whole number from 1 to 64"),
        ({"rgb_samples": 65}, "rgb_samples=65"),
        ({"size": (64.5, 48)}, r"size=\(64.5, 48\)"),
        ({"size": (-1, 48)}, r"size=\(-1, 48\)"),
    ]
    for arguments, words in wrong:
        with pytest.raises(s3d.UsageError, match=words):
            scene.render(**{"K": K, "T_world_cam": AHEAD, "size": (64, 48), **arguments})
    with pytest.raises(s3d.UsageError, match="seed=-1"):
        s3d.sample(box(), 10, seed=-1)
    with pytest.raises(s3d.MissingFileError) as missing:
        s3d.read_mesh(tmp_path / "gone.obj")
    assert "os error" not in str(missing.value) and missing.value.errno == 2


def test_points_are_written_in_the_form_that_they_are_named_after(tmp_path: Path) -> None:
    xyz = np.array([[0, 0, 1], [2.5, -1, 0.25]], np.float32)
    rgb, labels = np.array([[255, 0, 9], [1, 2, 3]], np.uint8), np.array([7, -1])
    with pytest.raises(s3d.UsageError, match=r"written as \.ply, \.las or \.npz"):
        s3d.save_points(tmp_path / "points.e57", xyz, rgb)
    for name in ("points.las", "points.ply", "points.npz"):
        s3d.save_points(tmp_path / name, xyz, rgb, labels)
        s3d.save_points(tmp_path / f"plain_{name}", xyz)
        with pytest.raises(s3d.UsageError, match="1 labels for 2 points"):
            s3d.save_points(tmp_path / name, xyz, rgb, labels[:1])
    with np.load(tmp_path / "points.npz") as arrays:
        assert np.array_equal(arrays["label"], labels) and np.array_equal(arrays["rgb"], rgb)
    assert (tmp_path / "points.las").read_bytes()[:4] == b"LASF"
    assert b"property int label" in (tmp_path / "points.ply").read_bytes()

    laspy = pytest.importorskip("laspy")
    las = laspy.read(tmp_path / "points.las")
    assert np.allclose(las.xyz, xyz, atol=1e-4) and las.label.tolist() == [7, -1]
    assert (np.stack([las.red, las.green, las.blue], -1) // 257).tolist() == rgb.tolist()


def test_faces_of_arrays_keep_their_numbers(caplog: pytest.LogCaptureFixture) -> None:
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
    # The second has no area, and the fourth repeats the first.
    faces = [[0, 1, 2], [0, 1, 4], [0, 2, 3], [2, 0, 1], [1, 4, 2]]
    mesh = s3d.Mesh(corners, faces)
    assert len(mesh.faces) == 3 and mesh.source_faces.tolist() == [0, 2, 4]
    assert [text.split(":")[0] for text in mesh.warnings] == ["1 of 5 faces left out"] * 2
    assert caplog.text.count("left out") == 2 and "no area" in caplog.text and "same corners" in caplog.text
    labels = np.arange(5)
    assert np.array_equal(np.array(faces)[labels[mesh.source_faces]], mesh.faces)
    again = pickle.loads(pickle.dumps(mesh))
    assert again.source_faces.tolist() == [0, 2, 4] and np.array_equal(again.faces, mesh.faces)
    assert mesh.with_faces([2]).source_faces.tolist() == [4]
    with pytest.raises(s3d.UsageError, match="source_faces: 5 numbers"):
        s3d.Mesh(corners, faces, source_faces=[1, 2])


def test_points_of_a_data_set_know_its_labels(demo: Path) -> None:
    data = s3d.open(demo)
    points = data.points()
    labels = data.votes().label  # type: ignore[union-attr]
    assert len(points) > 10_000 and np.array_equal(points.label, labels[points.face])
    surface = data.mesh().vertices[data.mesh().faces[points.face]]
    assert (points.xyz >= surface.min(1) - 1e-4).all() and (points.xyz <= surface.max(1) + 1e-4).all()


def test_names_by_room_are_not_those_by_area(demo: Path) -> None:
    data = s3d.open(demo)
    annotated = s3d.read_points(demo / "s3dis" / "Area_1")
    by_room = {
        (i.class_name, i.room, i.number_in_room): i for i in data.instances()
    }
    assert len(by_room) == len(data.instances())
    for name in annotated.names:
        of_class, number, room = name.split("_", 2)
        assert (of_class, room, int(number)) in by_room
    # Spelled alike, and still not the same.
    name = annotated.names[0]
    assert s3d.NameInArea(str(name)) == str(name) and s3d.NameInArea(str(name)) != name
    assert not {*annotated.names} & {label.name for label in data.labels}
    assert name in {str(name): 1}


def test_arguments_that_do_not_fit_are_named(tmp_path: Path, room: s3d.Mesh) -> None:
    options: Any = {"size": 64.5}
    with pytest.raises(s3d.UsageError, match=r"^size=64\.5: invalid type"):
        s3d.export(room, tmp_path / "out", **options)
    with pytest.raises(s3d.UsageError, match='^allow="everything": must be one of'):
        s3d.export(room, tmp_path / "out", allow="everything")
    with pytest.raises(s3d.UsageError, match="^apart=0: must be above 0"):
        s3d.Scene(room).place_cameras(apart=0)
    # Any number of 64 bits is a seed.
    assert len(s3d.sample(room, points=5, seed=2**64 - 1)) == 5
    with pytest.raises(s3d.UsageError, match="^seed="):
        s3d.sample(room, points=5, seed=2**64)


def test_an_image_of_places_is_projected_as_it_is(demo: Path) -> None:
    view = s3d.open(demo).views()[0]
    pixels, depth = view.project(view.xyz)
    assert pixels.shape == (160, 160, 2) and depth.shape == (160, 160)
    seen = np.isfinite(view.depth)
    rows, columns = np.indices((160, 160)) + 0.5
    # Places are stored as half floats.
    assert np.abs(pixels[seen] - np.stack([columns, rows], -1)[seen]).max() < 3
    assert np.abs(depth[seen] - view.depth[seen]).max() < 0.03
