"""Annotated points in every form: the points of the built-in scene, written by libraries of other projects, give the same
export as its S3DIS tree."""

import json
import re
import shutil
from pathlib import Path

import pytest

np = pytest.importorskip("numpy")

CLASSES = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split()
EXPORT = ["--views", "2", "--size", "64", "--pano-width", "128", "--points-per-m2", "50"]


@pytest.fixture(scope="module")
def points(demo):
    """Returns the annotated points of the scene as columns, in the order of its tree: by room, class and
    number.
    """
    columns = {"xyz": [], "rgb": [], "room": [], "class": [], "instance": []}
    for file in sorted((demo / "scan" / "Area_1").glob("*/Annotations/*.txt")):
        name, number = re.fullmatch(r"(\w+)_(\d+)", file.stem).groups()
        rows = np.loadtxt(file, ndmin=2)
        n = len(rows)
        columns["xyz"].append(rows[:, :3])
        columns["rgb"].append(rows[:, 3:6].astype(np.uint8))
        columns["room"].append(np.full(n, file.parent.parent.name))
        columns["class"].append(np.full(n, CLASSES.index(name)))
        columns["instance"].append(np.full(n, int(number)))
    columns = {key: np.concatenate(parts) for key, parts in columns.items()}
    # Points of a cloud may come in any order, and nothing may depend on it.
    order = np.random.default_rng(1).permutation(len(columns["xyz"]))
    return {key: column[order] for key, column in columns.items()}


@pytest.fixture(scope="module")
def reference(s3d, demo, tmp_path_factory):
    """Returns the results of an export from the tree: see `results`."""
    out = tmp_path_factory.mktemp("tree") / "dataset"
    s3d("-q", "export", demo / "scan" / "scene.toml", "-o", out, *EXPORT)
    return results(out)


def results(out):
    """Returns all that follows from annotations: labels of faces, semantic images, instances, rooms."""
    area = out / "area_1"
    files = [out / "assets" / "semantic_labels.json", area / "3d" / "semantic.obj"]
    files += sorted(area.glob("*/semantic/*.png")) + sorted(area.rglob("instances.*")) + sorted(area.rglob("rooms.*"))
    assert len([f for f in files if f.suffix == ".png"]) > 5
    return {str(f.relative_to(out)): f.read_bytes() for f in files}


@pytest.fixture
def export(s3d, demo, tmp_path):
    """Exports the scene with another table of annotations. Their files are in `tmp_path`."""
    scan = demo / "scan"
    for file in scan.iterdir():
        if file.is_dir() and file.name.startswith("Area_"):
            continue
        (shutil.copytree if file.is_dir() else shutil.copy)(file, tmp_path / file.name)

    def run(table, *arguments, code=0):
        scene = (scan / "scene.toml").read_text()
        (tmp_path / "scene.toml").write_text(re.sub(r'\[annotations\]\npath += +"Area_1"\n', table, scene))
        done = s3d("export", tmp_path / "scene.toml", "-o", tmp_path / "out", *EXPORT, *arguments, code=code)
        return results(tmp_path / "out") if code == 0 else done.stderr

    return run


def same(found, reference, but=()):
    assert found.keys() == reference.keys()
    different = [name for name in found if found[name] != reference[name] and Path(name).name not in but]
    assert not different


def classes_table(codes=range(13)):
    return "[annotations.classes]\n" + "".join(f'"{code}" = "{name}"\n' for code, name in zip(codes, CLASSES))


def room_numbers(points):
    names, numbers = np.unique(points["room"], return_inverse=True)
    return list(names), numbers


# The points of an instance are in another order, so their order by voxel differs.
ORDER = ("instances.npz",)


@pytest.mark.parametrize("version, form, suffix", [("1.2", 3, "las"), ("1.4", 7, "laz")])
def test_las_a_room(export, points, reference, tmp_path, version, form, suffix):
    laspy = pytest.importorskip("laspy")
    paths = []
    for room in np.unique(points["room"]):
        mask = points["room"] == room
        header = laspy.LasHeader(version=version, point_format=form)
        # Coordinates as in the tree, which has a tenth of a millimetre or better.
        header.scales, header.offsets = [1e-6] * 3, [0] * 3
        las = laspy.LasData(header)
        las.x, las.y, las.z = points["xyz"][mask].T
        las.red, las.green, las.blue = points["rgb"][mask].astype(np.uint16).T * 257
        las.classification = points["class"][mask] + 2
        las.point_source_id = points["instance"][mask]
        las.write(tmp_path / f"{room}.{suffix}")
        paths.append(f"{room}.{suffix}")
    table = f'[annotations]\npaths = {json.dumps(paths)}\nclass = "classification"\ninstance = "point_source_id"\n'
    same(export(table + classes_table(range(2, 15))), reference, ORDER)


def test_las_offset_and_unlabelled_points(export, points, reference, tmp_path):
    laspy = pytest.importorskip("laspy")
    names, rooms = room_numbers(points)
    header = laspy.LasHeader(version="1.4", point_format=7)
    header.add_extra_dim(laspy.ExtraBytesParams("label", np.uint16))
    header.scales, header.offsets = [1e-6] * 3, [1000, -2000, 3]
    n = len(rooms)
    las = laspy.LasData(header)
    # One point in ten is added without a label.
    xyz = np.vstack([points["xyz"], points["xyz"][: n // 10] + 1.0]) + [1000, -2000, 3]
    las.x, las.y, las.z = xyz.T
    las["label"] = np.append(points["class"] + 100 * rooms, np.full(n // 10, 999))
    las.point_source_id = np.append(points["instance"], np.zeros(n // 10))
    las.write(tmp_path / "all.laz")
    # The file has no rooms, so an export without a named room fails.
    table = '[annotations]\npath = "all.laz"\nclass = "label"\noffset_m = [1000, -2000, 3]\nroom = "office_1"\n'
    message = export(table, code=1)
    assert "all.laz" in message and "classes that are not among the 13" in message and "[annotations.classes]" in message
    only = [(c, 100 * r + k) for r in range(len(names)) for k, c in enumerate(CLASSES)]
    keys = "".join(f'"{code}" = "{c if code < 100 else ""}"\n' for c, code in only) + '"999" = ""\n'
    found = export(table + "[annotations.classes]\n" + keys)
    labels = json.loads(found["assets/semantic_labels.json"])
    first = points["room"] == names[0]
    there = {(int(c), int(i)) for c, i in zip(points["class"][first], points["instance"][first])}
    # The table is padded with null labels.
    assert len([name for name in labels if not name.startswith("<UNK>")]) == len(there)


@pytest.mark.parametrize("text", [True, False])
def test_ply_with_a_column_of_rooms(export, points, reference, tmp_path, text):
    plyfile = pytest.importorskip("plyfile")
    # The rooms have several types, so each becomes a cloud of its own.
    paths = []
    rooms, counts = np.unique(points["room"], return_counts=True)
    for room in rooms:
        mask = points["room"] == room
        kinds = [(a, "f8") for a in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")] + [("label", "i4"), ("instance", "i4")]
        rows = np.empty(mask.sum(), kinds)
        columns = [*points["xyz"][mask].T, *points["rgb"][mask].T, points["class"][mask], points["instance"][mask]]
        for (name, _), column in zip(kinds, columns):
            rows[name] = column
        element = plyfile.PlyElement.describe(rows, "vertex")
        # Plyfile writes text slowly: the smallest room alone is text.
        as_text = text and room == rooms[counts.argmin()]
        plyfile.PlyData([element], text=as_text, byte_order="=" if as_text else ">").write(tmp_path / f"{room}.ply")
        paths.append(f"{room}.ply")
    same(export(f"[annotations]\npaths = {json.dumps(paths)}\n" + classes_table()), reference, ORDER)


def test_npy_with_names_of_rooms_and_classes(export, points, reference, tmp_path):
    n = len(points["xyz"])
    rows = np.empty(n, [("xyz", "f8", (3,)), ("rgb", "u1", (3,)), ("label", "U10"), ("instance", "u2"), ("place", "U20")])
    rows["xyz"], rows["rgb"], rows["instance"], rows["place"] = points["xyz"], points["rgb"], points["instance"], points["room"]
    rows["label"] = np.array(CLASSES)[points["class"]]
    np.save(tmp_path / "all.npy", rows)
    same(export('[annotations]\npath = "all.npy"\nrooms = "place"\n'), reference, ORDER)


@pytest.mark.parametrize("kind", ["npz", "compressed"])
def test_npz_arrays(export, points, reference, tmp_path, kind):
    save = np.savez if kind == "npz" else np.savez_compressed
    save(
        tmp_path / "all.npz",
        xyz=points["xyz"],
        rgb=points["rgb"] / 255,
        label=np.array(CLASSES)[points["class"]],
        instance=points["instance"],
        room=points["room"],
    )
    same(export('[annotations]\npath = "all.npz"\nrooms = "room"\n'), reference, ORDER)


def test_rooms_as_s3dis_preprocessing_leaves_them(export, points, reference, tmp_path):
    paths = []
    for room in np.unique(points["room"]):
        mask = points["room"] == room
        paths.append(f"Area_1_{room}.npy")
        columns = [points[key][mask] for key in ("xyz", "rgb", "class", "instance")]
        np.save(tmp_path / paths[-1], np.column_stack(columns).astype(np.float64))
    same(export(f"[annotations]\npaths = {json.dumps(paths)}\n"), reference, ORDER)


def test_e57_without_labels_says_what_to_do(export, points, tmp_path):
    pye57 = pytest.importorskip("pye57")
    with pye57.E57(str(tmp_path / "scan.e57"), mode="w") as file:
        x, y, z = points["xyz"].T
        r, g, b = points["rgb"].T
        file.write_scan_raw({"cartesianX": x, "cartesianY": y, "cartesianZ": z, "colorRed": r, "colorGreen": g, "colorBlue": b})
    message = export('[annotations]\npath = "scan.e57"\nroom = "office_1"\n', code=1)
    assert "scan.e57: has no column of classes" in message and "E57 itself knows no classes" in message


def scannet(points, folder):
    """Writes ScanNet's files of a scene with the vertices `points`, three vertices to a triangle."""
    plyfile = pytest.importorskip("plyfile")
    n = len(points["xyz"])
    vertex = np.empty(n, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
    for name, column in zip(vertex.dtype.names, [*points["xyz"].T, *points["rgb"].T]):
        vertex[name] = column
    face = np.empty(1, [("vertex_indices", "i4", (3,))])
    face["vertex_indices"] = [[0, 1, 2]]
    folder.mkdir()
    elements = [plyfile.PlyElement.describe(vertex, "vertex"), plyfile.PlyElement.describe(face, "face")]
    plyfile.PlyData(elements).write(folder / "scene0_vh_clean_2.ply")
    keys = sorted(set(zip(points["class"].tolist(), points["instance"].tolist())))
    segment = [keys.index(key) for key in zip(points["class"].tolist(), points["instance"].tolist())]
    (folder / "scene0_vh_clean_2.0.010000.segs.json").write_text(json.dumps({"sceneId": "scene0", "segIndices": segment}))
    groups = [{"id": k, "objectId": k, "segments": [k], "label": CLASSES[c]} for k, (c, _) in enumerate(keys)]
    (folder / "scene0.aggregation.json").write_text(
        json.dumps({"segmentsFile": "scannet.scene0_vh_clean_2.0.010000.segs.json", "segGroups": groups})
    )


def test_scannet(export, points, tmp_path):
    names = np.unique(points["room"])
    room = {key: column[points["room"] == names[0]] for key, column in points.items()}
    scannet(room, tmp_path / "scene0")
    found = export(f'[annotations]\npath = "scene0"\nroom = "{names[0]}"\n')
    # The instances are the same as in the tree of that room alone.
    shutil.rmtree(tmp_path / "out")
    paths = [f"Area_1_{names[0]}.npy"]
    np.save(tmp_path / paths[0], np.column_stack([room[k] for k in ("xyz", "rgb", "class", "instance")]))
    same(found, export(f"[annotations]\npaths = {json.dumps(paths)}\n"), ORDER)
    shutil.rmtree(tmp_path / "out")
    file = tmp_path / "scene0" / "scene0.aggregation.json"
    file.write_text(file.read_text().replace('"ceiling"', '"disco ball"'))
    message = export(f'[annotations]\npath = "scene0"\nroom = "{names[0]}"\n', code=1)
    assert '"disco ball"' in message and "unknown_as_clutter" in message


def test_lenient_counts_what_it_leaves_out(s3d, export, demo, reference, tmp_path):
    tree = tmp_path / "Area_1"
    shutil.copytree(demo / "scan" / "Area_1", tree)
    room = sorted(p for p in tree.iterdir() if p.is_dir())[0]
    wall = sorted(room.glob("Annotations/wall_*.txt"))[0]
    text = wall.read_bytes()
    wall.write_bytes(b"1.0 2.0x 3.0 1 2 3\n" + text)
    shutil.copy(wall, wall.with_name("wall_1 (1).txt"))
    (room / "Annotations" / "stairs_1.txt").write_bytes(text)
    table = '[annotations]\npath = "Area_1"\n'
    assert "stairs" in export(table, code=1) or "copy of" in export(table, code=1)
    (room / "Annotations" / "stairs_1.txt").unlink()
    wall.with_name("wall_1 (1).txt").unlink()
    message = export(table, code=1)
    assert f"{wall.name}, line 1" in message
    shutil.copy(wall, wall.with_name("wall_1 (1).txt"))
    same(export(table, "--lenient"), reference)
    told = s3d("info", "--lenient", tmp_path / "scene.toml").stdout
    assert "1 lines of annotations" in told and f"{wall.name}, line 1" in told and "wall_1 (1).txt" in told
