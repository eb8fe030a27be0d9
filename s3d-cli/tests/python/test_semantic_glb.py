"""Labels in glTF, read by the rules of EXT_mesh_features and EXT_structural_metadata, against `semantic.obj`."""

import json
import re
import shutil
import struct
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from test_scene_graph import UNLABELLED, labelled_faces

VALIDATOR = "gltf-validator@2.0.0-dev.3.10"
SMALL = ["--views", "2", "--size", "64", "--pano-width", "128", "--points-per-m2", "100"]
NUMBERS = {5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


@pytest.fixture(scope="module")
def out(s3d, demo, tmp_path_factory):
    out = tmp_path_factory.mktemp("glb") / "dataset"
    s3d("export", demo / "scan/scene.toml", "-o", out, "--semantic-glb", *SMALL)
    return out


class Glb:
    def __init__(self, path):
        data = path.read_bytes()
        magic, version, size = struct.unpack_from("<4sII", data)
        assert (magic, version, size) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[20 + length + 8 :]

    def view(self, number):
        view = self.json["bufferViews"][number]
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def column(self, number):
        accessor = self.json["accessors"][number]
        column = np.frombuffer(self.view(accessor["bufferView"]), NUMBERS[accessor["componentType"]])
        width = WIDTHS[accessor["type"]]
        assert len(column) == accessor["count"] * width
        return column.reshape(-1, width) if width > 1 else column

    def rows(self):
        """The columns of the table."""
        [table] = self.json["extensions"]["EXT_structural_metadata"]["propertyTables"]
        schema = self.json["extensions"]["EXT_structural_metadata"]["schema"]["classes"][table["class"]]["properties"]
        rows = {}
        for name, found in table["properties"].items():
            assert self.json["bufferViews"][found["values"]]["byteOffset"] % 8 == 0
            values = self.view(found["values"])
            if schema[name]["type"] == "STRING":
                assert found["stringOffsetType"] == "UINT32"
                ends = np.frombuffer(self.view(found["stringOffsets"]), np.uint32)
                rows[name] = [values[a:b].decode() for a, b in zip(ends, ends[1:])]
            else:
                assert (schema[name]["type"], schema[name]["componentType"]) == ("SCALAR", "UINT32")
                rows[name] = list(np.frombuffer(values, np.uint32))
            assert len(rows[name]) == table["count"]
        return rows


def test_the_table_is_that_of_the_data_set(out):
    names = json.loads((out / "assets/semantic_labels.json").read_text())
    rows = Glb(out / "area_1/3d/semantic.glb").rows()
    count = len(rows["name"])
    assert rows["name"] == names[:count] and set(names[count:]) <= {UNLABELLED}
    assert rows["instance"] == list(range(count))
    for name, of_class, room in list(zip(rows["name"], rows["class"], rows["room"]))[1:]:
        assert name.startswith(of_class + "_") and f"_{room}_" in name


def test_faces_and_labels_are_those_of_semantic_obj(out):
    glb = Glb(out / "area_1/3d/semantic.glb")
    names = glb.rows()["name"]
    found = []
    for primitive in glb.json["meshes"][0]["primitives"]:
        [ids] = primitive["extensions"]["EXT_mesh_features"]["featureIds"]
        assert (ids["attribute"], ids["propertyTable"], ids["nullFeatureId"]) == (0, 0, 0)
        # x, y, z of the file are x, −z, y of the world; OBJ has the file's.
        corners = glb.column(primitive["attributes"]["POSITION"])[glb.column(primitive["indices"])].reshape(-1, 3, 3)
        labels = glb.column(primitive["attributes"]["_FEATURE_ID_0"])[glb.column(primitive["indices"])].reshape(-1, 3)
        assert (labels == labels[:, :1]).all()
        assert len(set(labels.ravel()) - {0.0}) == ids["featureCount"]
        found += [(tuple(map(tuple, face)), names[int(label)]) for face, label in zip(corners.tolist(), labels[:, 0])]

    corners, labels = labelled_faces(out / "area_1/3d/semantic.obj")
    corners = np.stack([corners[..., 0], corners[..., 2], -corners[..., 1]], axis=-1).astype(np.float32)
    expected = [(tuple(map(tuple, face)), label) for face, label in zip(corners.tolist(), labels)]
    assert sorted(found) == sorted(expected)


def test_it_is_verified_and_exported_again(s3d, demo, out, tmp_path):
    assert "0 faults" in s3d("verify", out).stdout
    again, scene = tmp_path / "again", tmp_path / "scene.toml"
    mesh, cameras = out / "area_1/3d/semantic.glb", demo / "scan/cameras.csv"
    tables = {
        "mesh": f'path = "{mesh.as_posix()}"',
        "annotations": "mesh = true",
        "cameras": f'path = "{cameras.as_posix()}"',
    }
    scene.write_text("area = 1\n" + "".join(f"[{name}]\n{line}\n" for name, line in tables.items()))
    s3d("export", scene, "-o", again, *SMALL)
    first, second = (labelled_faces(path / "area_1/3d/semantic.obj") for path in (out, again))
    # Objects of a room are numbered in the order of the table, which sorts 10 before 9.
    unnumbered = lambda name: re.sub(r"_\d+_", "_", name, count=1)
    objects = lambda labels: sorted((unnumbered(name), faces) for name, faces in Counter(labels).items())
    assert objects(first[1]) == objects(second[1])


def test_a_mesh_without_labels_is_told(s3d, demo, tmp_path):
    done = s3d("export", demo / "scan/rgb.obj", "-o", tmp_path / "bare", "--semantic-glb", *SMALL)
    assert "no labels" in done.stdout + done.stderr
    assert not (tmp_path / "bare/area_1/3d/semantic.glb").exists()


def test_blender_opens_it_with_its_textures(out):
    script = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
meshes = [found.data for found in bpy.data.objects if found.type == "MESH"]
assert all("_FEATURE_ID_0" in mesh.attributes for mesh in meshes)
images = [image for image in bpy.data.images if image.has_data or image.packed_file]
print("found", sum(len(mesh.polygons) for mesh in meshes), len(images))
"""
    if subprocess.run([sys.executable, "-c", "import bpy"], capture_output=True).returncode:
        pytest.skip("bpy is not installed: it is large, and installed by hand")
    glb = out / "area_1/3d/semantic.glb"
    done = subprocess.run([sys.executable, "-c", script, glb], capture_output=True, text=True, check=True)
    [faces, images] = next(line.split()[1:] for line in done.stdout.splitlines() if line.startswith("found"))
    assert int(faces) == len(labelled_faces(out / "area_1/3d/semantic.obj")[1])
    assert int(images) == len(Glb(glb).json["images"])


def test_khronos_validator_finds_no_fault(out, tmp_path):
    node, npm = shutil.which("node"), shutil.which("npm")
    if not (node and npm):
        pytest.skip("Node and npm are not installed")
    if subprocess.run([npm, "install", "--prefix", tmp_path, "--silent", VALIDATOR], capture_output=True).returncode:
        pytest.skip("npm cannot fetch gltf-validator")
    script = """
        const bytes = new Uint8Array(require("fs").readFileSync(process.argv[1]));
        require("gltf-validator").validateBytes(bytes).then(report => console.log(JSON.stringify(report)));
    """
    glb = out / "area_1/3d/semantic.glb"
    done = subprocess.run([node, "-e", script, glb], cwd=tmp_path, capture_output=True, text=True, check=True)
    report = json.loads(done.stdout)
    assert report["info"]["totalTriangleCount"] > 1000
    assert (report["issues"]["numErrors"], report["issues"]["numWarnings"]) == (0, 0), report["issues"]["messages"]
