"""Meshes from files, arrays, and other packages."""

from __future__ import annotations

import gc
import threading
import types
from pathlib import Path

import numpy as np
import pytest

import s3d_py as s3d


def test_a_mesh_of_arrays_shows_its_own_memory(room: s3d.Mesh) -> None:
    assert room.faces.shape == (14, 3) and room.vertices.shape == (28, 3)
    assert room.vertices.dtype == np.float32 and room.faces.dtype == np.uint32
    assert room.area == pytest.approx(2 * (12 + 10 + 7.5) + 1)
    assert room.bounds.tolist() == [[0, 0, 0], [4, 3, 2.5]]
    assert np.array_equal(room.face_normals[0], [0, 0, 1]) and room.face_areas[12:].tolist() == [0.5, 0.5]
    one, two = room.vertices, room.vertices
    assert one.ctypes.data == two.ctypes.data and not one.flags.owndata
    with pytest.raises(ValueError):
        one[0, 0] = 9
    with pytest.raises(ValueError):
        one.flags.writeable = True
    assert repr(room) == "Mesh(14 faces, 60.0 m², 4.0 × 3.0 × 2.5 m, coloured)"


def test_a_mesh_is_shown_while_calls_on_other_threads_read_it() -> None:
    side = 150
    row, column = np.divmod(np.arange(side * side), side)
    inner = np.arange(side * side).reshape(side, side)[:-1, :-1].ravel()
    faces = np.stack([inner, inner + 1, inner + side], 1)
    mesh = s3d.Mesh(np.stack([row, column, row * 0], 1), faces)
    faults: list[BaseException] = []

    def read() -> None:
        try:
            for _ in range(20):
                s3d.Mesh(mesh.vertices, mesh.faces)
        except BaseException as fault:  # a panic is no Exception
            faults.append(fault)

    threads = [threading.Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults and not mesh.vertices.flags.writeable


def test_arrays_outlive_their_mesh() -> None:
    mesh = s3d.Mesh([[0, 0, 0], [1, 0, 0], [0, 7, 0]], [[0, 1, 2]])
    vertices = mesh.vertices
    del mesh
    gc.collect()
    ballast = [np.full((3, 3), k, np.float32) for k in range(1000)]
    assert vertices[2, 1] == 7 and len(ballast) == 1000


def test_faces_that_are_none_are_left_out() -> None:
    mesh = s3d.Mesh(np.eye(3), [[0, 1, 2], [0, 0, 1], [2, 0, 1]])
    assert mesh.faces.tolist() == [[0, 1, 2]]


def test_textures_lie_where_their_coordinates_say() -> None:
    image = np.zeros((64, 64, 3), np.uint8)
    image[:32] = 200  # the upper half
    corners = [[0, 5, 0], [4, 5, 0], [4, 5, 4], [0, 5, 4]]
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    by_vertex = s3d.Mesh(corners, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=image)
    by_corner = s3d.Mesh(
        corners, [[0, 1, 2], [0, 2, 3]], uv=np.array(uv)[[[0, 1, 2], [0, 2, 3]]], texture=[image]
    )
    view = s3d.look_at((2, 0, 2), (2, 5, 2))
    for mesh in (by_vertex, by_corner):
        assert mesh.texture_of_face.tolist() == [0, 0] and np.array_equal(mesh.textures[0], image)
        rgb = s3d.Scene(mesh).render(s3d.intrinsics((64, 64), 60), view, (64, 64), modalities=["rgb"]).rgb
        assert rgb[16, 32].tolist() == [200] * 3 and rgb[48, 32].tolist() == [1] * 3
    plain = s3d.Mesh(corners, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=image, texture_of_face=[-1, 0])
    assert plain.texture_of_face.tolist() == [-1, 0]


@pytest.mark.parametrize(
    "arguments, error, words",
    [
        (dict(vertices=np.eye(3), faces=[[0, 1, 3]]), s3d.MeshError, "vertex 3"),
        (
            dict(vertices=[[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]]),
            s3d.MeshError,
            "not finite",
        ),
        (dict(vertices=np.eye(3), faces=np.empty((0, 3), int)), s3d.MeshError, "no face with an area"),
        (dict(vertices=np.eye(3)[:, :2], faces=[[0, 1, 2]]), s3d.UsageError, "vertices: an array (n, 3)"),
        (dict(vertices=np.eye(3), faces=[[0, 1, -2]]), s3d.UsageError, "faces: indices from 0"),
        (dict(vertices=np.eye(3), faces=[[0, 1, 2.5]]), s3d.UsageError, "whole numbers"),
        (dict(vertices=np.eye(3), faces=[[0, 1, 2, 0]]), s3d.UsageError, "faces: an array (n, 3)"),
        (dict(vertices=np.eye(3), faces=[[0, 1, 2]], uv=[[0, 0]]), s3d.UsageError, "uv: (3, 2)"),
        (
            dict(vertices=np.eye(3), faces=[[0, 1, 2]], vertex_colors=[[1, 2, 3]]),
            s3d.MeshError,
            "vertex colours",
        ),
        (dict(vertices=np.eye(3), faces=[[0, 1, 2]], texture=np.zeros((4, 4))), s3d.UsageError, "texture"),
        (dict(vertices="wall", faces=[[0, 1, 2]]), s3d.UsageError, "vertices"),
    ],
)
def test_wrong_arrays_are_told(arguments: dict[str, object], error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        s3d.Mesh(**arguments)  # type: ignore[arg-type] # pyright: ignore[reportArgumentType]
    assert words in str(caught.value)


def test_files_are_read_and_their_faults_told(tmp_path: Path) -> None:
    good = tmp_path / "table.obj"
    good.write_text("v 0 1 0\nv 2 1 0\nv 2 1 -1\nv 0 1 -1\nf 1 2 3 4\nf 1 2 3\n")
    mesh = s3d.read_mesh(good)
    # A quad was cut, and the face that repeats a part of it left out.
    assert mesh.source_faces.tolist() == [0, 0]
    assert mesh.path == good and mesh.area == 2.0 and mesh.bounds[0, 2] == 1.0
    assert any("same corners" in warning for warning in mesh.warnings)
    assert s3d.read_mesh(str(good), up="z", units="cm").area == pytest.approx(0.0003, abs=0.001)

    bad = tmp_path / "bad.obj"
    bad.write_text("v 0 0 0\nv 1 0 x\n")
    with pytest.raises(s3d.FormatError) as caught:
        s3d.read_mesh(bad)
    assert caught.value.path == str(bad) and caught.value.line == 2 and "bad.obj, line 2" in str(caught.value)
    with pytest.raises(s3d.MissingFileError) as missing:
        s3d.read_mesh(tmp_path / "gone.obj")
    assert missing.value.filename == str(tmp_path / "gone.obj") and missing.value.errno == 2
    with pytest.raises(s3d.UnsupportedError, match=r"\.fbx"):
        s3d.read_mesh("scan.fbx")
    with pytest.raises(s3d.UsageError, match="up=.x.: must be one of y, z"):
        s3d.read_mesh(good, up="x")


def test_a_mesh_far_away_is_moved_and_says_so(tmp_path: Path) -> None:
    far = tmp_path / "far.obj"
    far.write_text("v 500000 0 -5400000\nv 500001 0 -5400000\nv 500000 0 -5400001\nf 1 2 3\n")
    moved, left = s3d.read_mesh(far), s3d.read_mesh(far, near=False)
    assert moved.offset.tolist() == [500000, 5400000, 0] and np.abs(moved.vertices).max() < 2
    assert left.offset.tolist() == [0, 0, 0] and left.bounds[0, 1] == 5400000


class _Trimesh:
    """Has the attributes of trimesh's meshes."""

    def __init__(self, visual: object) -> None:
        self.vertices = np.eye(3)
        self.faces = np.array([[0, 1, 2]])
        self.visual = visual


def test_objects_of_other_packages_are_taken() -> None:
    colors = np.array([[255, 0, 0, 255]] * 3, np.uint8)
    colored = s3d.as_mesh(_Trimesh(types.SimpleNamespace(kind="vertex", vertex_colors=colors)))
    assert colored.vertex_colors is not None and colored.vertex_colors.tolist() == [[255, 0, 0]] * 3
    y_up = s3d.as_mesh(_Trimesh(None), up="y")
    assert y_up.vertices.tolist() == [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    with pytest.raises(s3d.UsageError, match="dict is no mesh"):
        s3d.as_mesh({})


def _textured(folder: Path) -> Path:
    """A wall at y = 5 in a file with Z up. Its image has four colours."""
    image = np.full((64, 64, 3), 40, np.uint8)
    image[:32, :32], image[:32, 32:], image[32:, :32] = (220, 0, 0), (0, 220, 0), (0, 0, 220)
    pillow = pytest.importorskip("PIL.Image")
    pillow.fromarray(image).save(folder / "wall.png")
    (folder / "wall.mtl").write_text("newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n")
    path = folder / "wall.obj"
    path.write_text(
        "mtllib wall.mtl\nv 0 5 0\nv 4 5 0\nv 4 5 4\nv 0 5 4\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wall\n"
        "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    return path


def _picture(mesh: s3d.Mesh) -> list[list[int]]:
    """Returns the colours in the middle of each quarter of the wall."""
    view, k = s3d.look_at((2, 0, 2), (2, 5, 2)), s3d.intrinsics((64, 64), 40)
    rgb = s3d.Scene(mesh).render(k, view, (64, 64), modalities=["rgb"]).rgb
    return [rgb[j, i].tolist() for j in (16, 48) for i in (16, 48)]


QUARTERS = [[220, 0, 0], [0, 220, 0], [0, 0, 220], [40, 40, 40]]


def test_pictures_of_files_lie_where_others_put_them(tmp_path: Path) -> None:
    assert _picture(s3d.read_mesh(_textured(tmp_path), up="z")) == QUARTERS


def test_trimesh_itself(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    cube = trimesh.creation.box((1, 2, 3))
    assert s3d.as_mesh(cube).area == pytest.approx(22)
    cube.visual.vertex_colors = np.tile(np.array([9, 8, 7, 255], np.uint8), (8, 1))
    colors = s3d.as_mesh(cube).vertex_colors
    assert colors is not None and (colors == [9, 8, 7]).all()
    assert s3d.as_mesh(trimesh.Scene([cube])).area == pytest.approx(22)
    assert _picture(s3d.as_mesh(trimesh.load(_textured(tmp_path)))) == QUARTERS


def test_open3d_itself(tmp_path: Path) -> None:
    o3d = pytest.importorskip("open3d")
    cube = o3d.geometry.TriangleMesh.create_box(1, 2, 3)
    cube.paint_uniform_color([1, 0.5, 0])
    for mesh in (cube, o3d.t.geometry.TriangleMesh.from_legacy(cube)):
        ours = s3d.as_mesh(mesh)
        assert ours.area == pytest.approx(22) and ours.vertex_colors is not None
        assert ours.vertex_colors[0].tolist() == [255, 128, 0]
    assert _picture(s3d.as_mesh(o3d.io.read_triangle_mesh(str(_textured(tmp_path))))) == QUARTERS
