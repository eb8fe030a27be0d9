"""Scenes of habitat-sim, read by its rules and compared with the meshes of the data set.

The rules are those of facebookresearch/habitat-sim at 57ee494: HM3DSemanticScene.cpp (lines are cut at each
comma), GenericSemanticMeshData.cpp (colours of vertices become sRGB bytes, then objects).
"""

import json
import re
import struct

import numpy as np
import pytest
from test_scene_graph import UNLABELLED, labelled_faces


def read_glb(path):
    """The JSON of a GLB file, and a reader of its accessors."""
    data = path.read_bytes()
    magic, version, length, json_length, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    document = json.loads(data[20 : 20 + json_length])
    binary = data[28 + json_length :]

    def column(number):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        kind = {5126: np.float32, 5125: np.uint32, 5123: np.uint16}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        begin = view["byteOffset"]
        return np.frombuffer(binary, kind, accessor["count"] * width, begin).reshape(-1, width)

    return document, column


def srgb_bytes(light):
    """Colours of vertices, 16 bits, as habitat-sim turns them into bytes."""
    light = light[:, :3] / 65535
    encoded = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255).astype(np.uint8)


@pytest.fixture(scope="module")
def made(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("habitat") / "dataset"
    small = ["--views", "1", "--size", "64", "--pano-width", "128", "--points-per-m2", "100"]
    s3d("export", demo / "scan/scene.toml", "-o", out, *small)
    s3d("pack", out, "--to", "habitat")
    return out, out.with_name("dataset_habitat")


def test_a_scene_is_found_as_the_simulator_finds_it(made):
    _, package = made
    config = json.loads((package / "s3d.scene_dataset_config.json").read_text())
    [folder] = config["stages"]["paths"][".json"]
    [path] = (package / folder).glob("*.stage_config.json")
    stage = json.loads(path.read_text())
    for key in ["render_asset", "collision_asset", "semantic_asset", "semantic_descriptor_filename"]:
        assert (path.parent / stage[key]).is_file(), key
    assert stage["up"] == [0, 1, 0] and np.dot(stage["up"], stage["front"]) == 0
    assert not stage["has_semantic_textures"], "objects are told by colours of vertices"


def test_objects_are_those_of_the_faces(made):
    out, package = made
    scene = package / "area_1"
    corners, labels = labelled_faces(out / "area_1/3d/semantic.obj")
    names = json.loads((scene / "area_1.names.json").read_text())

    head, *lines = (scene / "area_1.semantic.txt").read_text().splitlines()
    assert head == "HM3D Semantic Annotations"
    objects = {}
    for line in lines:
        number, color, name, region = line.split(",")
        objects[int(color, 16)] = (int(number), name.replace('"', ""), int(region))
    assert len(objects) == len(lines) == len(names["objects"])

    document, column = read_glb(scene / "area_1.semantic.glb")
    [mesh] = document["meshes"]
    [primitive] = mesh["primitives"]
    indices = column(primitive["indices"]).reshape(-1, 3)
    assert len(indices) == len(labels), "the same faces in the same order"
    x, y, z = column(primitive["attributes"]["POSITION"])[indices].transpose(2, 0, 1)
    assert np.abs(np.stack([x, -z, y], axis=2) - corners).max() < 1e-5

    packed = srgb_bytes(column(primitive["attributes"]["COLOR_0"])).astype(int) @ [65536, 256, 1]
    of_corners = packed[indices]
    assert (of_corners == of_corners[:, :1]).all(), "a face has one colour"
    seen = set()
    for label, color in zip(labels, of_corners[:, 0]):
        if color not in objects:
            assert color == 0 and label == UNLABELLED
            continue
        number, name, region = objects[color]
        assert names["objects"][number - 1] == label
        kind, _, room, of_type, _ = label.rsplit("_", 4)
        assert (name, names["regions"][region]) == (kind, f"{room}_{of_type}")
        seen.add(number)
    assert seen == set(range(1, len(objects) + 1)), "each object has faces"


def test_others_read_the_textured_stage(made):
    trimesh = pytest.importorskip("trimesh")
    out, package = made
    scene = trimesh.load(package / "area_1/area_1.glb")
    parts = list(scene.geometry.values())
    corners, labels = labelled_faces(out / "area_1/3d/semantic.obj")
    assert sum(len(part.faces) for part in parts) == len(labels)
    assert sum(part.area for part in parts) == pytest.approx(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2,
        rel=1e-5)
    textured = [part for part in parts if part.visual.kind == "texture"]
    assert any(part.visual.material.baseColorTexture is not None for part in textured)


def test_s3d_reads_it_back(made, s3d):
    _, package = made
    told = s3d("info", package / "area_1")
    objects = json.loads((package / "area_1/area_1.names.json").read_text())["objects"]
    assert "read as a scene of HM3D" in told.stdout
    # Each object is in the line of its room.
    rooms = [line for line in told.stdout.splitlines() if line.startswith("  lounge_") and " points, " in line]
    counts = [int(count) for line in rooms for count in re.findall(r"(\d+) [a-z]", line.rpartition(": ")[2])]
    assert sum(counts) == len(objects)
