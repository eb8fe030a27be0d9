"""Scene graphs, recounted from the meshes and images of the data set."""

import importlib.util
import json
from collections import Counter

import numpy as np
import pytest

UNLABELLED = "<UNK>_0_<UNK>_0_0"
"""The material of faces without a label."""


def labelled_faces(path):
    """Of semantic.obj the corners of each face in the world, and the label of each face."""
    corners, faces, labels, label = [], [], [], None
    for line in path.read_text().splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            corners.append([float(number) for number in rest.split()[:3]])
        elif word == "usemtl":
            label = rest.strip()
        elif word == "f":
            faces.append([int(corner.split("/")[0]) - 1 for corner in rest.split()])
            labels.append(label)
    x, y, z = np.array(corners).T
    # The file has +Y up.
    return np.stack([x, -z, y], axis=1)[np.array(faces)], np.array(labels)


def lower_median(values):
    return np.sort(values)[(len(values) - 1) // 2]


@pytest.fixture(scope="module")
def made(s3d, demo, tmp_path_factory):
    """A data set with objects, and its graph."""
    out = tmp_path_factory.mktemp("graph") / "dataset"
    small = ["--views", "4", "--size", "120", "--pano-width", "256", "--points-per-m2", "100"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small, "--modalities", "depth,semantic,objects,pose")
    s3d("pack", out, "--to", "scene-graph")
    package = out.with_name("dataset_scene-graph")
    return out, json.loads((package / "area_1.json").read_text())


def test_nodes_are_those_of_the_meshes(made):
    out, graph = made
    corners, labels = labelled_faces(out / "area_1/3d/semantic.obj")
    names = json.loads((out / "assets/semantic_labels.json").read_text())
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2

    objects = {o["id"]: o for o in graph["objects"]}
    assert graph["building"]["objects"] == len(objects)
    with_faces = {o["id"] for o in objects.values() if o["faces"]}
    assert {label for label in labels if label in objects} == with_faces
    for name, found in objects.items():
        own = labels == name
        assert names[found["label_index"]] == name and found["faces"] == own.sum(), name
        assert found["surface_m2"] == pytest.approx(areas[own].sum(), rel=1e-4), name
        if own.any():
            # The box stands upright, and no corner lies outside of it.
            turn = np.radians(found["yaw_deg"])
            axes = [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
            inside = np.abs((corners[own].reshape(-1, 3) - found["center"]) @ np.transpose(axes))
            assert (inside <= np.array(found["size_m"]) / 2 + 1e-4).all(), name
            assert (inside.max(axis=0) >= np.array(found["size_m"]) / 2 - 1e-4).all(), name

    rooms = {room["id"]: room for room in graph["rooms"]}
    records = {room["room"]: room for room in json.loads((out / "area_1/3d/rooms.json").read_text())}
    assert rooms.keys() == records.keys() == {o["room"] for o in objects.values()}
    for name, room in rooms.items():
        assert room["floor_area_m2"] == records[name]["floor_m2"]
        of_class = {kind: corners[np.isin(labels, [o["id"] for o in objects.values()
                    if (o["class"], o["room"]) == (kind, name)])] for kind in ["floor", "ceiling"]}
        if len(of_class["floor"]):
            heights = of_class["floor"][..., 2]
            assert heights.min() - 1e-4 <= room["floor_z"] <= heights.max() + 1e-4
        if room["volume_m3"] is not None:
            assert room["volume_m3"] == pytest.approx(
                room["floor_area_m2"] * (room["ceiling_z"] - room["floor_z"]))


def test_doors_join_the_rooms_of_the_plan(made):
    _, graph = made
    adjacent = {tuple(sorted(pair["rooms"])): pair["doors"] for pair in graph["relations"]["adjacent_rooms"]}
    assert set(adjacent) == {
        ("conferenceRoom_1", "hallway_1"), ("hallway_1", "lounge_1"), ("hallway_1", "office_1")}
    doors = [o["id"] for o in graph["objects"] if o["class"] == "door"]
    assert sorted(sum(adjacent.values(), [])) == sorted(
        door for door in doors if any(door in of for of in adjacent.values()))


def test_cameras_see_what_their_images_show(made):
    out, graph = made
    spec = importlib.util.spec_from_file_location("utils_of_graph", out / "assets/utils.py")
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    data = utils.Dataset(out)
    index_of = {o["id"]: o["label_index"] for o in graph["objects"]}

    relations = graph["relations"]
    orders = {order["camera"]: order for order in relations["orders"]}
    hidden = Counter()
    for relation in relations["occlusions"]:
        hidden[relation["camera"], relation["hidden"], relation["by"]] += relation["pixels"]
    images = {image.stem: image for kind in ["data", "pano"] for image in data.images(kind)}
    assert images.keys() == {camera["id"] for camera in graph["cameras"]} == orders.keys()

    for camera in graph["cameras"]:
        image = images[camera["id"]]
        pose, labels = data.pose(image), data.semantic(image)
        assert camera["location"] == pose["camera_location"]
        shown = {name: index for name, index in index_of.items() if (labels == index).any()}
        assert {seen["object"]: seen["pixels"] for seen in camera["sees"]} == {
            name: (labels == index).sum() for name, index in shown.items()}

        # From near to far, and from left to right.
        distances = np.linalg.norm(data.world_points(image) - np.array(pose["camera_location"]), axis=2)
        far = [lower_median(distances[labels == index_of[name]])
               for name in orders[camera["id"]]["near_to_far"]]
        assert len(far) == len(shown) and all(np.diff(far) > -0.02)
        to_the_right = orders[camera["id"]]["left_to_right"]
        if camera["kind"] == "panorama":
            assert to_the_right is None
            continue
        middles = []
        for name in to_the_right:
            columns = np.nonzero((labels == index_of[name]).any(axis=0))[0]
            middles.append(columns.min() + columns.max())
        assert len(middles) == len(shown) and all(np.diff(middles) >= 0)

        # What hides an object is seen where the object would be.
        for thing in data.objects(image):
            mask = utils.decode_mask(thing["amodal_mask"]).astype(bool)
            for name, index in shown.items():
                if name != thing["label"]:
                    count = hidden.get((camera["id"], thing["label"], name), 0)
                    assert count == (mask & (labels == index)).sum(), (camera["id"], thing["label"], name)


def test_what_is_not_known_is_null(s3d, demo, tmp_path):
    package = tmp_path / "graph"
    done = s3d("pack", demo, "--to", "scene-graph", "-o", package)
    assert "need the modality objects" in done.stderr
    relations = json.loads((package / "area_1.json").read_text())["relations"]
    assert relations["orders"] is None and relations["occlusions"] is None
    assert len(relations["adjacent_rooms"]) == 3
