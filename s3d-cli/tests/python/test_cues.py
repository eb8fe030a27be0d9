"""Cues counted again from the files of a small building, with numpy and scipy."""

import importlib.util

import numpy as np
import pytest

ndimage = pytest.importorskip("scipy.ndimage")

CUES = (
    "depth_euclidean,edge_texture,keypoints2d,mask_valid,edge_instance,boundary_distance,reshading,"
    "principal_curvature,edge_occlusion,keypoints3d,segment_unsup2d,segment_unsup25d"
)


@pytest.fixture(scope="module")
def data(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("cues") / "out"
    small = ["--views", "2", "--size", "96", "--pano-width", "192", "--points-per-m2", "50"]
    others = "rgb,depth,normal,semantic,global_xyz,pose,"
    what = ["--xyz", "float", "--modalities", others + CUES]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small, *what)
    spec = importlib.util.spec_from_file_location("utils_of_cues", out / "assets" / "utils.py")
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    return utils, utils.Dataset(out)


def images(data, most=12):
    """Some views and some panoramas."""
    return [image for kind in ("data", "pano") for image in data.images(kind)[:most]]


def shifted(values, dx, dy, wraps):
    """The value of the neighbour at (dx, dy) of each pixel, and whether there is one."""
    there = np.ones(values.shape, bool)
    if dy:
        there[-1 if dy > 0 else 0] = False
    if dx and not wraps:
        there[:, -1 if dx > 0 else 0] = False
    return np.roll(values, (-dy, -dx), (0, 1)), there


def neighbours(values, wraps):
    """The four neighbours of each pixel, as `shifted` gives them."""
    return [shifted(values, dx, dy, wraps) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))]


def test_distances_are_those_of_the_coordinates(data):
    _, data = data
    step = 0.5 / data.conventions["depth"]["units_per_m"]
    for image in images(data):
        points = data.xyz(image).astype(np.float64) - data.pose(image)["camera_location"]
        distance, found = np.linalg.norm(points, axis=-1), data.depth_euclidean(image)
        assert np.array_equal(np.isnan(distance), np.isnan(found))
        assert np.nanmax(np.abs(distance - found)) < step + 1e-4


def test_masks_say_what_is_seen(data):
    _, data = data
    for image in images(data):
        mask = data.mask_valid(image)
        assert np.array_equal(mask, data.semantic(image) >= 0)
        assert np.array_equal(mask, ~np.isnan(data.reshading(image)))
        assert np.array_equal(mask, ~np.isnan(data.principal_curvature(image)[..., 0]))
        for numbers in (data.segment_unsup2d(image), data.segment_unsup25d(image)):
            assert np.array_equal(mask, numbers > 0)
            # Numbers are whole, in the order of their first pixels.
            values, first = np.unique(numbers[numbers > 0], return_index=True)
            assert np.array_equal(values, np.arange(1, len(values) + 1)) and len(values) > 1


def test_light_is_lamberts(data):
    _, data = data
    for image in images(data):
        points = data.xyz(image).astype(np.float64) - data.pose(image)["camera_location"]
        d = np.linalg.norm(points, axis=-1)
        cos = -np.sum(data.world_normals(image) * points, axis=-1) / d
        light = np.clip(2.5 * cos * 8 / (8 + d**2), 1 / 255, 1)
        # Normals have 8 bits a channel.
        assert np.nanmax(np.abs(light - data.reshading(image))) < 0.03


def test_borders_of_instances(data):
    _, data = data
    count = 0
    for image in images(data):
        labels, wraps = data.semantic(image), image.kind == "pano"
        border = np.zeros(labels.shape, bool)
        for other, there in neighbours(labels, wraps):
            border |= there & (labels != other) & (labels >= 0) & (other >= 0)
        assert np.array_equal(border, data.edge_instance(image))
        count += border.sum()

        # A panorama three times over has no seam in its middle.
        wide = np.tile(border, (1, 3)) if wraps else border
        distance = ndimage.distance_transform_edt(~wide) if border.any() else np.full(wide.shape, 1e9)
        distance = distance[:, labels.shape[1] : 2 * labels.shape[1]] if wraps else distance
        expected = np.where(labels < 0, np.nan, np.minimum(np.floor(distance * 64 + 0.5), 65534) / 64)
        assert np.array_equal(expected, data.boundary_distance(image), equal_nan=True)
    assert count > 1000


def test_edges_of_colours(data):
    utils, data = data
    kernel = np.array([1, 8, 28, 56, 70, 56, 28, 8, 1])
    strongest = 0
    for image in images(data):
        r, g, b = np.moveaxis(data.rgb(image).astype(np.int64), -1, 0)
        gray = (19595 * r + 38470 * g + 7471 * b + 32768) >> 16
        across = "wrap" if image.kind == "pano" else "edge"
        gray = np.pad(np.pad(gray, ((0, 0), (5, 5)), across), ((5, 5), (0, 0)), "edge")
        blurred = ndimage.correlate1d(gray, kernel, axis=1)[:, 4:-4]
        blurred = (ndimage.correlate1d(blurred, kernel, axis=0)[4:-4] + 128) >> 8
        smooth = np.array([1, 2, 1])
        h = ndimage.correlate1d(ndimage.correlate1d(blurred, [-1, 0, 1], axis=1), smooth, axis=0)[1:-1, 1:-1]
        v = ndimage.correlate1d(ndimage.correlate1d(blurred, [-1, 0, 1], axis=0), smooth, axis=1)[1:-1, 1:-1]
        expected = np.minimum(np.floor(np.sqrt((h**2 + v**2) / 131072) + 0.5), 255)
        found = utils.read_png(data.path(image, "edge_texture")).astype(np.float64)
        # Sums of squares have 24 bits: a tie may fall to either side.
        assert np.abs(expected - found).max() <= 1 and (expected != found).mean() < 1e-3
        strongest = max(strongest, found.max())
    assert strongest > 50


def test_occluders_are_in_front(data):
    _, data = data
    edges = 0
    for image in images(data):
        depth, wraps = data.depth(image), image.kind == "pano"
        farther = np.zeros(depth.shape, bool)
        for other, there in neighbours(depth, wraps):
            farther |= there & (other - depth > 0.006)
        edge = data.edge_occlusion(image)
        assert not (edge & ~farther).any()
        edges += edge.sum()
    assert edges > 100
