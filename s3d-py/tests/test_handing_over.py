"""What is handed to other packages, and comes back: meshes, poses, tables, pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d

from common import AHEAD, K, box


@pytest.fixture(scope="module")
def ds(demo: Path) -> s3d.DataSet:
    return s3d.open(demo)


def test_views_and_panoramas_are_two_types(ds: s3d.DataSet) -> None:
    assert all(isinstance(view, s3d.View) for view in ds.views())
    assert all(isinstance(view, s3d.Panorama) and view.K is None for view in ds.panoramas())
    assert {type(view) for view in ds} == {s3d.View, s3d.Panorama}
    assert repr(ds.panoramas()[0]).startswith("Panorama(") and repr(ds.views()[0]).startswith("View(")


def test_points_are_projected_to_where_they_are_seen(ds: s3d.DataSet) -> None:
    for image in (ds.views()[3], ds.panoramas()[1]):
        points, depth = image.points().reshape(-1, 3), image.depth.ravel()
        width, height = image.size
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        seen = ~np.isnan(depth)
        pixels, depths = image.project(points[seen])
        assert np.abs(depths - depth[seen]).max() < 1e-3
        # At the poles of a panorama a column is narrow.
        rows = np.abs(y.ravel()[seen] / height - 0.5) < 0.45
        error = np.abs(pixels - np.stack([x.ravel(), y.ravel()], 1)[seen])[rows]
        assert error.max() < 0.02
    view = ds.views()[3]
    behind = view.T_world_cam[:3, 3] - view.T_world_cam[:3, 2]
    pixels, depths = view.project([behind])
    assert np.isnan(pixels).all() and depths[0] == pytest.approx(-1)


def test_views_do_not_keep_what_they_read(ds: s3d.DataSet) -> None:
    views = list(ds.views())
    first = views[0].rgb
    assert views[0].rgb is first
    assert views[1].rgb.shape == first.shape
    again = views[0].rgb
    assert again is not first and np.array_equal(again, first)
    kept = views[2].load("rgb")
    held = kept.rgb
    assert views[3].depth.ndim == 2 and kept.rgb is held


def test_views_are_selected_by_rooms_and_by_any_rule(ds: s3d.DataSet) -> None:
    rooms = sorted({view.room for view in ds.views()})[:2]
    both = ds.views(room=rooms)
    assert {view.room for view in both} == set(rooms)
    assert len(both) == sum(len(ds.views(room=room)) for room in rooms)
    low = ds.views(where=lambda view: view.frame % 2 == 0)
    assert 0 < len(low) < len(ds.views()) and all(view.frame % 2 == 0 for view in low)
    with pytest.raises(s3d.UsageError, match="room='attic_1'"):
        ds.views(room=[rooms[0], "attic_1"])


def test_tables_of_a_data_set(ds: s3d.DataSet) -> None:
    outlines = ds.outlines()
    assert outlines.keys() == {room.name for room in ds.rooms}
    x, y = outlines["conferenceRoom_1"][0].outer.T
    assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 10
    assert "occupancy" in " ".join(ds.voxels()) or len(ds.voxels()) > 2
    assert ds.splits == []
    pandas = pytest.importorskip("pandas")
    table = ds.to_pandas()
    assert isinstance(table, pandas.DataFrame) and list(table.index) == list(range(len(ds)))
    kept = table[~table.is_panorama]
    assert (kept.entropy >= 0).all() and kept.frame.notna().all() and table[table.is_panorama].frame.isna().all()
    assert table.name[5] == ds[5].name


def test_pictures_are_in_the_colours_of_the_data_set(ds: s3d.DataSet, tmp_path: Path) -> None:
    view = ds.views()[0]
    shown = ds.show(view, "classes")
    colors = ds.class_colors
    assert colors is not None
    seen = view.classes >= 0
    assert (shown.pixels[seen] == colors[view.classes[seen]]).all() and (shown.pixels[~seen] == 0).all()
    for word in ("rgb", "depth", "normal", "labels", "instances", "pretty"):
        assert view.picture(word).pixels.shape == (*view.rgb.shape[:2], 3)
    shown.save(tmp_path / "classes.png")
    assert (tmp_path / "classes.png").read_bytes() == shown._repr_png_()


def _poses(ds: s3d.DataSet) -> list[s3d.CameraPose]:
    return [s3d.CameraPose(f"{i}.5", v.T_world_cam, v.K, v.size) for i, v in enumerate(ds.views()[:6])]


@pytest.mark.parametrize("name", ["transforms.json", "groundtruth.txt", "sparse"])
def test_poses_come_back(ds: s3d.DataSet, tmp_path: Path, name: str) -> None:
    written = _poses(ds)
    s3d.save_poses(tmp_path / name, written)
    read = s3d.read_poses(tmp_path / name)
    assert len(read) == 6
    for a, b in zip(written, read):
        assert np.allclose(a.T_world_cam, b.T_world_cam, atol=1e-6), name
        if name != "groundtruth.txt":
            assert b.size == a.size and np.allclose(a.K, b.K)  # type: ignore[arg-type]
    assert sorted(file.name for file in tmp_path.rglob(".*")) == []


def test_wrong_poses_are_told(ds: s3d.DataSet, tmp_path: Path) -> None:
    bare = s3d.CameraPose("1", AHEAD)
    for name, poses, words in [
        ("a.json", [bare], "1: its intrinsics"),
        ("a.json", [], "there are none"),
        ("a.csv", [bare], "written as .json"),
        ("b", [s3d.CameraPose("1", AHEAD, K, (64, 48), ("fisheye", [0.1] * 4))], "a fisheye lens"),
    ]:
        with pytest.raises(s3d.UsageError, match=words):
            s3d.save_poses(tmp_path / name, poses)
    with pytest.raises(s3d.MissingFileError):
        s3d.read_poses(tmp_path / "gone.json")
    # A matrix that is no pose would come back as another one.
    s3d.save_poses(tmp_path / "kept.txt", [bare])
    kept = (tmp_path / "kept.txt").read_bytes()
    for wrong in (2 * AHEAD, AHEAD.T, AHEAD * [-1, 1, 1, 1], AHEAD * np.nan):
        with pytest.raises(s3d.UsageError, match="1: T_world_cam"):
            s3d.save_poses(tmp_path / "kept.txt", [s3d.CameraPose("1", wrong, K, (64, 48))])
    with pytest.raises(s3d.UsageError, match="some CameraPose"):
        s3d.save_poses(tmp_path / "kept.txt", [AHEAD])  # type: ignore[list-item]
    assert (tmp_path / "kept.txt").read_bytes() == kept


def test_meshes_are_cut_moved_and_joined(tmp_path: Path) -> None:
    room = box()
    low = room.cropped([[-1, -1, -0.1], [9, 9, 0.75]])
    assert len(low.faces) == 4 and low.area == pytest.approx(13) and len(low.vertices) == 8
    turn = np.array([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    moved = room.transformed(turn)
    assert np.allclose(moved.vertices, room.vertices @ turn[:3, :3].T + turn[:3, 3], atol=1e-6)
    mirrored = room.transformed(np.diag([-1.0, 1, 1, 1]))
    assert np.allclose(mirrored.face_normals, room.face_normals * [-1, 1, 1], atol=1e-6)
    both = s3d.Mesh.merged([room, moved])
    assert both.area == pytest.approx(2 * room.area) and len(both.faces) == 28
    assert np.array_equal(both.with_faces(np.arange(28) >= 14).vertices, moved.vertices)
    assert np.array_equal(room.with_faces([3, 1]).faces, room.with_faces([1, 3]).faces)
    # Faces keep their numbers.
    assert room.with_faces([3, 1]).source_faces.tolist() == [1, 3]
    assert low.transformed(turn).source_faces.tolist() == low.source_faces.tolist() and len(low.source_faces) == 4
    assert low.cropped([[-1, -1, 0.5], [9, 9, 0.75]]).source_faces.tolist() == low.source_faces[-2:].tolist()
    assert both.source_faces.tolist() == list(range(28))
    wrong: list[tuple[Any, str]] = [
        (lambda: room.with_faces([99]), "faces: 99"),
        (lambda: room.transformed(np.zeros((4, 4))), "affine"),
        (lambda: room.with_faces(np.ones(3, bool)), "a mask of shape"),
        (lambda: room.save(tmp_path / "room.fbx"), "written as .glb or .ply"),
    ]
    for call, words in wrong:
        with pytest.raises(s3d.UsageError, match=words):
            call()
    with pytest.raises(s3d.MeshError):
        room.cropped([[50, 50, 50], [51, 51, 51]])


def _looks(mesh: Any) -> Any:
    return s3d.Scene(mesh).render(K, AHEAD, (64, 48), modalities=["rgb", "depth"])


def _textured() -> s3d.Mesh:
    """The room with a picture on two of its walls, and without one on the others."""
    room = box()
    rng = np.random.default_rng(3)
    images = [rng.integers(1, 255, (16, 16, 3), np.uint8) for _ in range(2)]
    uv = np.tile(np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32), (7, 1, 1))
    of_face = np.repeat([-1, -1, 0, 1, 0, 1, -1], 2)
    white = np.full((14, 3), 255, np.uint8)
    return s3d.Mesh(
        room.vertices, room.faces, uv=uv, texture=images, texture_of_face=of_face, face_colors=white
    )


@pytest.mark.parametrize("mesh", [box(), _textured()], ids=["colours", "textures"])
def test_meshes_come_back_from_files_and_packages(mesh: s3d.Mesh, tmp_path: Path) -> None:
    before = _looks(mesh)
    forms: dict[str, Any] = {}
    mesh.save(tmp_path / "room.glb")
    forms["glb"] = s3d.read_mesh(tmp_path / "room.glb")
    if not mesh.textures:
        mesh.save(tmp_path / "room.ply")
        forms["ply"] = s3d.read_mesh(tmp_path / "room.ply", up="z")
    else:
        with pytest.raises(s3d.UsageError, match="PLY holds no textures"):
            mesh.save(tmp_path / "room.ply")
    for name in ("trimesh", "open3d"):
        try:
            forms[name] = getattr(mesh, f"to_{name}")()
        except s3d.UsageError as error:
            assert "pip install" in str(error)
    for name, form in forms.items():
        after = _looks(form)
        assert np.array_equal(after.depth, before.depth), name
        assert np.abs(after.rgb.astype(int) - before.rgb).max() <= 1, name
