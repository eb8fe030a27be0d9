"""Images of cameras, and hits of rays."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d

from common import AHEAD, K

ALL = ("rgb", "depth", "normal", "xyz", "face")


@pytest.fixture(scope="module")
def scene(room: s3d.Mesh) -> s3d.Scene:
    return s3d.Scene(room)


def open_box() -> s3d.Mesh:
    """A wall at x = 2; a camera at the origin sees it in half of its image."""
    return s3d.Mesh([[2, -9, 0], [2, 9, 0], [2, 9, 9], [2, -9, 9]], [[0, 2, 1], [0, 3, 2]])


def test_a_wall_ahead_is_where_it_stands(scene: s3d.Scene) -> None:
    images = scene.render(K, AHEAD, (64, 48), modalities=ALL)
    assert images.size == (64, 48) and images.modalities == ALL
    assert images.rgb[24, 32].tolist() == [170] * 3
    assert images.depth.dtype == np.float32 and images.depth[24, 32] == 2.0
    assert np.array_equal(images.normal[24, 32], [0, 0, -1])
    # The centre of the pixel is half a pixel right of the middle and half a pixel below. The wall is 2 m
    # away; right is −Y.
    assert images.xyz[24, 32] == pytest.approx([4.0, 1.5 - 1 / 32, 1.2 - 1 / 32], abs=1e-6)
    assert set(images.face[24, [0, 32]].tolist()) <= set(range(4, 12))
    # The world coordinates agree with the depth.
    rays = np.linalg.inv(K) @ [32.5, 24.5, 1.0]
    assert AHEAD[:3, :3] @ (rays * images.depth[24, 32]) + AHEAD[:3, 3] == pytest.approx(
        images.xyz[24, 32], abs=1e-6
    )
    assert "view, 64 × 48: rgb, depth, normal, xyz, face" in repr(images)
    with pytest.raises(AttributeError, match="'xyz' was not asked for"):
        scene.render(K, AHEAD, (64, 48)).xyz  # noqa: B018


def test_nothing_has_documented_values() -> None:
    scene = s3d.Scene(open_box())
    images = scene.render(K, s3d.look_at((0, 0, 0), (1, 0, 0)), (64, 48), modalities=ALL)
    seen = images.face >= 0
    assert seen[:24].all() and not seen[24:].any()
    assert np.isnan(images.depth[~seen]).all() and np.isfinite(images.depth[seen]).all()
    assert np.isnan(images.normal[~seen]).all() and np.isnan(images.xyz[~seen]).all()
    assert (
        (images.rgb[~seen] == 0).all() and (images.rgb[seen] > 0).all() and (images.face[~seen] == -1).all()
    )
    stored = scene.render_stored(K, s3d.look_at((0, 0, 0), (1, 0, 0)), (64, 48), modalities=ALL)
    assert {name: array.dtype.name for name, array in stored.items()} == {
        "rgb": "uint8",
        "depth": "uint16",
        "normal": "uint8",
        "xyz": "float16",
        "face": "int32",
    }
    assert (stored["depth"][~seen] == 65535).all() and (stored["normal"][~seen] == 128).all()
    assert (stored["xyz"][~seen] == 0).all() and (stored["depth"][seen] == 1024).all()


def test_a_panorama_looks_all_around(scene: s3d.Scene) -> None:
    for pose in ((2.0, 1.5, 1.2), s3d.Location("", s3d.look_at((2, 1.5, 1.2), (2, 3, 1.2)))):
        images = scene.panorama(pose, 64, modalities=ALL)
        assert images.K is None and images.size == (64, 32)
        # +Y is ahead, +X to the right. A panorama has distances, not depths.
        assert images.depth[16, 32] == pytest.approx(1.5, abs=0.01) and images.depth[16, 48] == pytest.approx(
            2, abs=0.02
        )
        assert images.depth[0, 0] == pytest.approx(1.3, abs=0.01) and images.depth[31, 0] == pytest.approx(
            1.2, abs=0.01
        )
        distance = np.linalg.norm(images.xyz - [2, 1.5, 1.2], axis=-1)
        assert distance == pytest.approx(images.depth, abs=1e-5)
        # (X, −Z, Y): the wall ahead has the normal −Y, the floor +Z.
        assert np.array_equal(images.normal[16, 32], [0, 0, -1]) and np.array_equal(
            images.normal[31, 0], [0, -1, 0]
        )


def test_normals_are_unit_vectors_towards_the_camera(scene: s3d.Scene) -> None:
    pose = s3d.look_at((1.7, 0.4, 1.9), (3.1, 2.2, 0.3))
    images = scene.render(K, pose, (64, 48), modalities=ALL)
    world = images.normal @ pose[:3, :3].T.astype(np.float32)
    towards = pose[:3, 3] - images.xyz
    assert np.linalg.norm(images.normal, axis=-1) == pytest.approx(1.0, abs=1e-6)
    assert ((world * towards).sum(-1) > 0).all()
    assert np.abs(np.abs((world * scene.mesh.face_normals[images.face]).sum(-1)) - 1).max() < 1e-6


def test_rays_hit_what_images_show(scene: s3d.Scene) -> None:
    images = scene.render(K, AHEAD, (64, 48), modalities=ALL)
    j, i = np.mgrid[:48, :64]
    pixels = np.stack([i + 0.5, j + 0.5, np.ones_like(i)], -1) @ np.linalg.inv(K).T
    rays = scene.cast(AHEAD[:3, 3], (pixels @ AHEAD[:3, :3].T).reshape(-1, 3))
    assert len(rays) == 64 * 48 and rays.t.reshape(48, 64) == pytest.approx(images.depth, rel=1e-6)
    assert (rays.face.reshape(48, 64) == images.face).mean() > 0.99
    assert rays.xyz.reshape(48, 64, 3) == pytest.approx(images.xyz, abs=1e-5)

    two = scene.cast([[2, 1.5, 1.2], [2, 1.5, 99]], [[0, 0, -2], [0, 0, 1]], threads=1)
    assert two.t[0] == 0.6 and two.face[0] in (0, 1)
    assert np.isnan(two.t[1]) and two.face[1] == -1 and np.isnan(two.xyz[1]).all()
    with pytest.raises(s3d.UsageError, match=r"origins of shape \(2,\) for directions of \(3,\)"):
        scene.cast(np.zeros((2, 3)), np.ones((3, 3)))
    with pytest.raises(s3d.UsageError, match=r"directions: an array \(…, 3\), not of shape \(1, 2\)"):
        scene.cast([0, 0, 0], [[1, 2]])


def test_rays_come_in_any_shape_and_know_their_faces(scene: s3d.Scene) -> None:
    random = np.random.default_rng(3)
    ways = random.normal(size=(5, 40, 3))
    rays = scene.cast((2, 1.5, 1.2), ways)
    assert rays.t.shape == rays.face.shape == (5, 40) and rays.xyz.shape == (5, 40, 3)
    flat = scene.cast(np.concatenate([np.tile([2, 1.5, 1.2], (200, 1)), ways.reshape(-1, 3)], -1))
    assert np.array_equal(flat.t, rays.t.reshape(-1), equal_nan=True)

    seen = rays.face >= 0
    assert seen.any()
    corners = scene.mesh.vertices[scene.mesh.faces[rays.face]]
    weights = rays.barycentrics
    assert (weights[seen] >= -1e-6).all() and weights[seen].sum(-1) == pytest.approx(1)
    assert (weights[..., None] * corners).sum(-2)[seen] == pytest.approx(rays.xyz[seen], abs=1e-6)
    assert ((rays.normal * ways).sum(-1)[seen] < 0).all()
    assert np.linalg.norm(rays.normal[seen], axis=-1) == pytest.approx(1)

    # A ray that hits nothing, and a mesh without texture coordinates.
    nothing = s3d.Scene(open_box()).cast((0, 0, 0), [-1, 0, 0])
    assert all(np.isnan(of).all() for of in (nothing.barycentrics, nothing.normal, nothing.uv, nothing.xyz))
    square = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
    image = np.zeros((2, 2, 3), np.uint8)
    textured = s3d.Mesh(
        square, [[0, 1, 2], [0, 2, 3]], uv=[[0, 0], [1, 0], [1, 1], [0, 1]], texture=image
    )
    down = s3d.Scene(textured).cast([[0.5, 1.5, 1], [1.5, 0.2, 1]], [[0, 0, -1]] * 2)
    assert down.uv == pytest.approx(np.array([[0.25, 0.75], [0.75, 0.1]]))
    with pytest.raises(s3d.UsageError, match=r"rays without directions: an array \(…, 6\), not of shape \(1, 3\)"):
        scene.cast([[0, 0, 0]])
    with pytest.raises(s3d.UsageError, match="points: could not convert"):
        scene.closest_points("nowhere")
    with pytest.raises(s3d.UsageError, match="one for all, or one for each"):
        scene.cast(np.zeros((4, 3)), np.ones((2, 2, 3)))


def test_occlusions_and_counts_agree_with_first_hits(scene: s3d.Scene) -> None:
    ways = np.random.default_rng(4).normal(size=(3000, 3))
    eye = (2, 1.5, 1.2)
    rays = scene.cast(eye, ways)
    assert np.array_equal(scene.test_occlusions(eye, ways), rays.face >= 0)
    assert np.array_equal(scene.test_occlusions(eye, ways, before=0.9), rays.t < 0.9)
    assert np.array_equal(scene.count_intersections(eye, ways) > 0, rays.face >= 0)
    # What is hit is not hidden, and what is behind it is.
    seen = rays.face >= 0
    to = rays.xyz[seen] - eye
    assert not scene.test_occlusions(eye, to, before=1 - 1e-6).any()
    assert scene.test_occlusions(eye, 1.001 * to, before=1 - 1e-6).all()


def test_distances_have_signs_where_the_mesh_is_watertight(room: s3d.Mesh) -> None:
    corners = np.array(list(itertools.product([0, 2], [0, 3], [0, 1])), np.float32)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    box = s3d.Mesh(corners, faces)
    assert box.is_watertight and not s3d.Mesh(corners, faces[1:]).is_watertight
    scene = s3d.Scene(box)

    points = np.random.default_rng(5).uniform(-1, 4, (30, 20, 3))
    low, high = np.maximum(-points, 0), np.maximum(points - [2, 3, 1], 0)
    outside = np.linalg.norm(low + high, axis=-1)
    inside = np.minimum(points, [2, 3, 1] - points).min(-1)
    expected = np.where(inside > 0, -inside, outside)
    assert scene.signed_distance(points) == pytest.approx(expected, abs=1e-5)
    assert np.array_equal(scene.contains(points), inside > 0)
    closest = scene.closest_points(points)
    assert closest.distance == pytest.approx(abs(expected), abs=1e-5)
    assert np.linalg.norm(closest.xyz - points, axis=-1) == pytest.approx(abs(expected), abs=1e-5)
    assert (closest.barycentrics >= -1e-5).all()
    nowhere = scene.closest_points([np.nan, 0, 0])
    assert nowhere.face[0] == -1 and np.isnan(nowhere.distance[0]) and np.isnan(nowhere.xyz).all()
    with pytest.raises(s3d.InputError, match="not watertight: its surface ends at"):
        s3d.Scene(open_box()).signed_distance(points)


def test_distances_are_those_of_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("scipy")
    pytest.importorskip("rtree")
    ball = trimesh.creation.icosphere(subdivisions=2)
    points = np.random.default_rng(6).uniform(-1.5, 1.5, (200, 3))
    # trimesh counts distances inside as positive.
    theirs = -trimesh.proximity.signed_distance(ball, points)
    ours = s3d.Scene(ball).signed_distance(points)
    assert ours == pytest.approx(theirs, abs=1e-5)


def test_many_views_are_those_of_single_calls_in_order(scene: s3d.Scene) -> None:
    poses = [s3d.look_at((2, 1.5, 1.2), (2 + np.cos(a), 1.5 + np.sin(a), 1.0)) for a in np.linspace(0, 6, 23)]
    for threads in (1, 2, 5):
        many = list(scene.render_many(poses, K, (64, 48), modalities=ALL, threads=threads))
        assert len(many) == len(poses)
        for pose, images in zip(poses, many):
            alone = scene.render(K, pose, (64, 48), modalities=ALL)
            assert np.array_equal(images.T_world_cam, pose)
            assert all(np.array_equal(images[name], alone[name], equal_nan=name != "rgb") for name in ALL)
    # The generator may be left early, and its input may be endless.
    first = list(itertools.islice(scene.render_many(itertools.repeat(AHEAD), K, (64, 48)), 3))
    assert len(first) == 3
    with pytest.raises(s3d.UsageError, match="T_world_cam"):
        list(scene.render_many([AHEAD, np.eye(3)], K, (64, 48)))


def _interrupt() -> None:
    raise KeyboardInterrupt


def test_a_stack_has_the_pixels_of_single_images(scene: s3d.Scene) -> None:
    poses = [s3d.look_at((2, 1.5, 1.2), (3 * np.cos(a), 3 * np.sin(a), 1.0)) for a in np.linspace(0, 6, 21)]
    ks = [K * [[f, 1, 1], [1, f, 1], [1, 1, 1]] for f in np.linspace(0.5, 1.5, len(poses))]
    for threads, several in itertools.product((1, 3), (False, True)):
        given = np.array(ks) if several else K
        stack = scene.render_stack(poses, given, (64, 48), modalities=ALL, rgb_samples=4, threads=threads)
        assert list(stack) == list(ALL)
        for i, pose in enumerate(poses):
            k = ks[i] if several else K
            alone = scene.render(k, pose, (64, 48), modalities=ALL, rgb_samples=4)
            for name in ALL:
                assert stack[name].dtype == alone[name].dtype and stack[name].shape[0] == len(poses)
                assert np.array_equal(stack[name][i], alone[name], equal_nan=name not in ("rgb", "face"))
    smooth = scene.render_stack(poses[:2], K, (64, 48), modalities="normal", smooth_normals=True)
    assert smooth["normal"].shape == (2, 48, 64, 3)

    # Anything with a pose will do.
    posed = scene.render_stack([s3d.CameraPose("a", AHEAD), s3d.Camera(AHEAD, 75.0)], K, (64, 48))
    assert np.array_equal(posed["rgb"][0], posed["rgb"][1])
    with pytest.raises(KeyboardInterrupt):
        scene.render_stack([AHEAD] * 5000, K, (64, 48), progress=lambda task: _interrupt())
    with pytest.raises(s3d.UsageError, match="size=64"):
        scene.render_stack(poses, K, 64)  # type: ignore[arg-type]
    with pytest.raises(s3d.UsageError, match="poses: there are none"):
        scene.render_stack([], K, (64, 48))
    with pytest.raises(s3d.UsageError, match="21 poses and 2 K"):
        scene.render_stack(poses, ks[:2], (64, 48))
    with pytest.raises(s3d.UsageError, match="T_world_cam"):
        scene.render_stack([AHEAD, np.eye(3)], K, (64, 48))
    with pytest.raises(s3d.UsageError, match='"colour" is none of'):
        scene.render_stack(poses, K, (64, 48), modalities=["colour"])
    with pytest.raises(s3d.TooLargeError):
        scene.render_stack([AHEAD] * 2000, K, (32_000, 32_000))


def test_threads_share_a_scene(scene: s3d.Scene) -> None:
    expected = scene.render(K, AHEAD, (64, 48), modalities=ALL)
    start = threading.Barrier(8)

    def work(_: int) -> bool:
        start.wait()
        for _ in range(25):
            images = scene.render(K, AHEAD, (64, 48), modalities=ALL)
            if not all(np.array_equal(images[name], expected[name]) for name in ALL):
                return False
        return True

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(8)))


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is read from /proc")
def test_memory_stays_flat_over_ten_thousand_renders(scene: s3d.Scene) -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def render(times: int) -> None:
        for _ in range(times):
            scene.render(K, AHEAD, (64, 48), modalities=ALL)

    render(500)
    before = resident()
    render(10_000)
    # A leak of one byte a pixel would be 31 MB.
    assert resident() - before < 4 << 20


@pytest.mark.parametrize(
    "k, pose, size, words",
    [
        (np.eye(4), AHEAD, (64, 48), "K: a matrix 3 × 3"),
        ([[50, 1, 32], [0, 50, 24], [0, 0, 1]], AHEAD, (64, 48), "skew"),
        ([[0, 0, 32], [0, 50, 24], [0, 0, 1]], AHEAD, (64, 48), "K: focal lengths"),
        (K, AHEAD.T, (64, 48), "transposed"),
        (K, AHEAD * 2, (64, 48), "T_world_cam"),
        (K, AHEAD + [[0, 0, 0, np.inf], *[[0] * 4] * 3], (64, 48), "not finite"),
        (K, np.diag([1.0, 1, -1, 1]), (64, 48), "mirrors"),
        (K, AHEAD, (0, 48), "size=(0, 48)"),
        (K, AHEAD, (64, 100_000), "size=(64, 100000)"),
    ],
)
def test_what_is_no_camera_is_told(
    scene: s3d.Scene, k: Any, pose: Any, size: tuple[int, int], words: str
) -> None:
    with pytest.raises(s3d.UsageError) as caught:
        scene.render(k, pose, size)
    assert words in str(caught.value)


def test_other_wrong_calls_are_told(scene: s3d.Scene) -> None:
    with pytest.raises(s3d.UsageError, match='"smell" is none of rgb, depth'):
        scene.render(K, AHEAD, (64, 48), modalities=["rgb", "smell"])
    with pytest.raises(s3d.UsageError, match="name some of"):
        scene.render(K, AHEAD, (64, 48), modalities=[])
    with pytest.raises(s3d.UsageError, match="rgb_samples=0"):
        scene.render(K, AHEAD, (64, 48), rgb_samples=0)
    with pytest.raises(s3d.UsageError, match="a panorama is half as high"):
        scene.panorama((1, 1, 1), 63)
    with pytest.raises(s3d.UsageError, match="fov=180"):
        s3d.intrinsics((64, 48), 180)
    with pytest.raises(s3d.UsageError, match="target is where the camera is"):
        s3d.look_at((1, 1, 1), (1, 1, 1))


def test_pictures_for_notebooks(scene: s3d.Scene) -> None:
    for name in ALL:
        png = scene.render(K, AHEAD, (64, 48), modalities=[name])._repr_png_()
        assert png[:8] == b"\x89PNG\r\n\x1a\n" and png[16:24] == (64).to_bytes(4, "big") + (48).to_bytes(
            4, "big"
        )


def test_pictures_lie_beside_and_over_each_other(scene: s3d.Scene) -> None:
    images = scene.render(K, AHEAD, (64, 48), modalities=ALL)
    depth = images.picture("depth").pixels
    near, far = np.nanargmin(images.depth), np.nanargmax(images.depth)
    assert depth.reshape(-1, 3)[near].sum() > depth.reshape(-1, 3)[far].sum() > 0
    assert images.picture().beside(images.picture("depth"), images.picture("normal")).pixels.shape == (48, 192, 3)
    black = np.zeros((48, 64, 3), np.uint8)
    half = black.copy()
    half[:, :32] = 200
    over = images.picture().under(s3d.Picture(half), 0.25).pixels
    assert np.array_equal(over[:, 32:], images.rgb[:, 32:])
    assert np.array_equal(over[:, :32], np.rint(0.75 * images.rgb[:, :32] + 50).astype(np.uint8))

    small = s3d.Picture(np.zeros((8, 8, 3), np.uint8))
    for call, words in (
        (lambda: s3d.Picture(np.zeros((8, 8, 3))), "uint8"),  # type: ignore[arg-type]
        (lambda: images.picture().beside(small), "one height"),
        (lambda: images.picture().under(small), "one size"),
        (lambda: small.under(small, 2.0), "share=2.0"),
        (lambda: small.save("picture.jpg"), "written as .png"),
    ):
        with pytest.raises(s3d.UsageError, match=words):
            call()


def test_images_are_those_of_the_command_to_the_bit(demo: Path, tmp_path: Path) -> None:
    mesh = demo / "scan" / "rgb.obj"
    scene = s3d.Scene(s3d.read_mesh(mesh))
    places = scene.place_cameras(see=0.6)
    size, k = (160, 120), np.array([[120.5, 0, 79.25], [0, 119.75, 61.5], [0, 0, 1]])
    turn = [(0.3, 0.8, -0.2), (-1, 0.1, 0.05)]
    poses = [s3d.look_at(p.xyz, p.xyz + np.array(d)) for p in places[:3] for d in turn]
    opengl = [(T * [1, -1, -1, 1]).tolist() for T in poses]
    cameras = tmp_path / "transforms.json"
    cameras.write_text(
        json.dumps(
            {
                "w": size[0],
                "h": size[1],
                "fl_x": k[0, 0],
                "fl_y": k[1, 1],
                "cx": k[0, 2],
                "cy": k[1, 2],
                "frames": [{"file_path": f"{n:03}.png", "transform_matrix": T} for n, T in enumerate(opengl)],
            }
        )
    )
    out = tmp_path / "views"
    command = [
        sys.executable,
        "-m",
        "s3d_py",
        "render",
        str(mesh),
        "--poses",
        str(cameras),
        "-o",
        str(out),
        "--rgb-samples",
        "4",
        "--quiet",
    ]
    subprocess.run(command, check=True)
    # The reader that comes with a data set and needs numpy alone.
    spec = importlib.util.spec_from_file_location("utils", demo / "assets" / "utils.py")
    assert spec and spec.loader
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    for number, pose in enumerate(poses):
        stored = scene.render_stored(k, pose, size, modalities=ALL, rgb_samples=4)
        exact = scene.render(k, pose, size, modalities=ALL, rgb_samples=4)
        read = {name: out / name / f"{number:03}.png" for name in ("rgb", "depth", "normal", "faces")}
        for name in ("rgb", "depth", "normal"):
            assert np.array_equal(utils.read_png(read[name]), stored[name]), (number, name)
        index = utils.read_png(read["faces"]).astype(np.int64) @ [65536, 256, 1]
        assert np.array_equal(np.where(index == 0xFFFFFF, -1, index), stored["face"])
        xyz = utils.read_xyz(out / "global_xyz" / f"{number:03}.exr")
        assert np.array_equal(np.nan_to_num(xyz), stored["xyz"].astype(xyz.dtype))
        # The stored numbers are these, rounded.
        seen = exact.face >= 0
        assert seen.mean() > 0.9 and np.array_equal(exact.rgb, stored["rgb"])
        depth = np.floor(exact.depth[seen].astype(np.float64) * 512 + 0.5)
        assert np.array_equal(depth, stored["depth"][seen])
        assert np.array_equal(exact.xyz[seen].astype(np.float16), stored["xyz"][seen])
        normal = 127.5 + 127.5 * exact.normal[seen].astype(np.float64) * [1, 1, -1]
        assert np.abs(normal - stored["normal"][seen]).max() <= 0.5 + 1e-4


def test_locations_are_placed_alike_for_any_number_of_threads(demo: Path) -> None:
    scene = s3d.Scene(demo / "scan" / "rgb.obj")
    done: list[s3d.Task] = []
    one = scene.place_cameras(see=0.8, threads=1, progress=done.append)
    two = scene.place_cameras(see=0.8, threads=3)
    assert 1 < len(one) < 40 and [p.uuid for p in one] == [p.uuid for p in two]
    assert all(np.array_equal(p.T_world_cam, q.T_world_cam) for p, q in zip(one, two))
    assert all(len(p.uuid) == 32 and 1.0 < p.xyz[2] < 2.0 for p in one)
    apart = scene.place_cameras(apart=2.0)
    assert {p.uuid for p in apart} != {p.uuid for p in one}
    with pytest.raises(s3d.UsageError, match="see"):
        scene.place_cameras(see=1.5)
    with pytest.raises(s3d.UsageError, match="see"):
        scene.place_cameras(see=0.5, apart=2.0)
    with pytest.raises(s3d.InputError):
        s3d.Scene(open_box()).place_cameras()
