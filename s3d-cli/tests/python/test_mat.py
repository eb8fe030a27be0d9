"""`pointcloud.mat` against h5py, mat73, pymatreader and hdf5storage: they read the files of `s3d`, and `s3d`
reads theirs.
"""

import json

import pytest

h5py = pytest.importorskip("h5py")
np = pytest.importorskip("numpy")


@pytest.fixture(scope="module")
def path(demo):
    return demo / "area_1" / "3d" / "pointcloud.mat"


def text(dataset):
    assert dataset.attrs["MATLAB_class"] == b"char" and dataset.attrs["MATLAB_int_decode"] == 2
    return "".join(map(chr, dataset[()].T.ravel()))


def structs(file, group):
    """Returns the elements of a struct array: a dict for each object."""
    assert group.attrs["MATLAB_class"] == b"struct"
    fields = [b"".join(name).decode() for name in group.attrs["MATLAB_fields"]]
    assert sorted(fields) == sorted(group)
    columns = [group[name] for name in fields]
    if all(isinstance(c, h5py.Dataset) and c.dtype == h5py.ref_dtype and "MATLAB_class" not in c.attrs for c in columns):
        return [dict(zip(fields, (file[r] for r in row))) for row in zip(*(c[()].ravel() for c in columns))]
    return [dict(zip(fields, columns))]


@pytest.fixture(scope="module")
def rooms(path):
    """{room: (angle, {object: fields as numpy arrays in MATLAB's shapes})}"""
    found = {}
    with h5py.File(path) as file:
        assert file.userblock_size == 512
        (area,) = structs(file, file["Area"])
        assert text(area["name"]) == "Area_1"
        for room in structs(file, area["Disjoint_Space"]):
            objects = {}
            for o in structs(file, room["object"]):
                fields = {k: d[()].T for k, d in o.items() if k not in ("name", "global_name", "Points_per_Voxel")}
                fields["global_name"] = text(o["global_name"])
                assert o["Points_per_Voxel"].attrs["MATLAB_class"] == b"cell"
                cells = [file[r] for r in o["Points_per_Voxel"][()].T.ravel()]
                fields["Points_per_Voxel"] = [
                    np.zeros(0, np.uint32) if "MATLAB_empty" in c.attrs else c[()].ravel() for c in cells
                ]
                objects[text(o["name"])] = fields
            color = room["color"][()].T
            assert color.shape == (1, 3) and 0 <= color.min() and color.max() <= 1
            found[text(room["name"])] = (float(room["AlignmentAngle"][0, 0]), objects)
    return found


def test_points_are_those_of_the_s3dis_tree(demo, rooms):
    tree = demo / "s3dis" / "Area_1"
    angles = dict(line.split() for line in (tree / "Area_1_alignmentAngle.txt").read_text().splitlines()[2:])
    assert sorted(rooms) == sorted(p.name for p in tree.iterdir() if p.is_dir())
    total = 0
    for room, (angle, objects) in rooms.items():
        assert angle == float(angles[room])
        files = sorted(p.stem for p in (tree / room / "Annotations").iterdir())
        assert sorted(objects) == files
        for name, fields in objects.items():
            expected = np.loadtxt(tree / room / "Annotations" / f"{name}.txt", ndmin=2)
            assert fields["points"].dtype == np.float32 and fields["RGB_color"].dtype == np.uint8
            assert fields["points"].shape == (len(expected), 3)
            assert np.abs(fields["points"] - expected[:, :3]).max() <= 0.000_501
            assert (fields["RGB_color"] == expected[:, 3:]).all()
            total += len(expected)
    assert total > 100_000


def test_boxes_and_voxels_are_those_of_the_points(rooms):
    for _, objects in rooms.values():
        for fields in objects.values():
            points = fields["points"]
            box = np.concatenate([points.min(0), points.max(0)])
            assert (fields["Bbox"] == box).all() and fields["Bbox"].shape == (1, 6)
            voxels, members = fields["Voxels"], fields["Points_per_Voxel"]
            assert voxels.shape == (216, 6) and len(members) == 216
            assert (voxels.min(0)[:3] == box[:3]).all() and (voxels.max(0)[3:] == box[3:]).all()
            assert (fields["Voxel_Occupancy"].ravel() == [len(m) > 0 for m in members]).all()
            assert (np.sort(np.concatenate(members)) == np.arange(1, len(points) + 1)).all()
            for voxel, rows in zip(voxels, members):
                inside = points[rows.astype(int) - 1]
                assert (inside >= voxel[:3]).all() and (inside <= voxel[3:]).all()
            # z varies fastest, as in instances.npz.
            size = (box[3:] - box[:3]) / 6
            order = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), -1).reshape(-1, 3)
            assert np.allclose(voxels[:, :3], box[:3] + order * size, atol=1e-4)


def test_labels_and_boxes_agree_with_the_annotated_instances(demo, rooms):
    instances = np.load(demo / "area_1" / "3d" / "instances.npz")
    box_of = dict(zip(instances["labels"].tolist(), instances["bbox"]))
    labels = set(json.loads((demo / "assets" / "semantic_labels.json").read_text()))
    for room, (_, objects) in rooms.items():
        for name, fields in objects.items():
            label = fields["global_name"]
            assert label in labels and label in box_of
            assert label.split("_")[0] == name.split("_")[0] and label.split("_", 2)[2] == f"{room}_1"
            # The boxes there belong to the annotated points, the boxes here to points on the faces that these
            # won: close, not equal.
            assert (np.abs(fields["Bbox"][0] - box_of[label]) < 1.0).all(), label


def test_mat73_reads_it(path, rooms):
    mat73 = pytest.importorskip("mat73")
    area = mat73.loadmat(str(path))["Area"]
    assert area["name"] == "Area_1"
    assert [s["name"] for s in area["Disjoint_Space"]] == list(rooms)
    for space in area["Disjoint_Space"]:
        angle, objects = rooms[space["name"]]
        assert space["AlignmentAngle"] == angle and space["object"]["name"] == list(objects)
        for points, fields in zip(space["object"]["points"], objects.values()):
            assert (points == fields["points"].squeeze()).all()


def test_pymatreader_reads_it(path, rooms):
    pymatreader = pytest.importorskip("pymatreader")
    spaces = pymatreader.read_mat(str(path))["Area"]["Disjoint_Space"]
    assert spaces["name"] == list(rooms)
    for objects, (_, expected) in zip(spaces["object"], rooms.values()):
        assert objects["name"] == list(expected)
        for colors, fields in zip(objects["RGB_color"], expected.values()):
            assert (np.asarray(colors) == fields["RGB_color"].squeeze()).all()


def test_hdf5storage_reads_it(path, rooms):
    hdf5storage = pytest.importorskip("hdf5storage")
    area = hdf5storage.loadmat(str(path))["Area"]
    spaces = area["Disjoint_Space"][0, 0].ravel()
    assert [str(np.squeeze(s["name"])) for s in spaces] == list(rooms)
    for space, (_, expected) in zip(spaces, rooms.values()):
        objects = np.atleast_1d(np.squeeze(space["object"]))
        assert sum(len(o["points"]) for o in objects) == sum(len(f["points"]) for f in expected.values())


class Mat:
    """Writes a v7.3 file with h5py: structs, struct arrays and their content."""

    def __init__(self, path):
        self.file = h5py.File(path, "w", userblock_size=512)
        self.refs = self.file.create_group("#refs#")

    def put(self, group, name, value):
        if isinstance(value, dict):
            group = group.create_group(name)
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            for key, v in value.items():
                self.put(group, key, v)
            return group
        if isinstance(value, list):
            group = group.create_group(name)
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            for key in value[0]:
                refs = [[self.put(self.refs, f"r{len(self.refs)}", v[key]).ref] for v in value]
                group.create_dataset(key, data=np.array(refs, dtype=h5py.ref_dtype))
            return group
        if isinstance(value, str):
            value, kind = np.array([[ord(c) for c in value]], np.uint16), "char"
        else:
            value, kind = np.atleast_2d(value), "double"
        how = {"compression": "gzip", "shuffle": True, "chunks": True} if value.size > 100 else {}
        dataset = group.create_dataset(name, data=value.T, **how)
        dataset.attrs["MATLAB_class"] = np.bytes_(kind)
        return dataset


def write_tree_as_mat(tree, path):
    mat = Mat(path)
    rooms = []
    for room in sorted(p for p in tree.iterdir() if p.is_dir()):
        objects = []
        for file in sorted((room / "Annotations").iterdir()):
            rows = np.loadtxt(file, ndmin=2)
            objects.append({"name": file.stem, "points": rows[:, :3], "RGB_color": rows[:, 3:]})
        rooms.append({"name": room.name, "AlignmentAngle": 0.0, "object": objects})
    mat.put(mat.file, "Area", {"name": "Area_1", "Disjoint_Space": rooms})
    mat.file.close()
    with open(path, "r+b") as f:
        f.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def scene_with(scan, annotations):
    """Copies the demo's scene file to another folder, with other annotations."""
    text = (scan / "scene.toml").read_text()
    for name in ["rgb.obj", "Area_1", "cameras.csv"]:
        assert f'"{name}"' in text
        text = text.replace(f'"{name}"', f"'{annotations if name == 'Area_1' else scan / name}'")
    return text


def test_a_file_by_h5py_gives_the_labels_that_its_text_files_give(s3d, demo, tmp_path):
    """Writes the demo's annotations twice: as they are, and as arrays of doubles, chunked and deflated."""
    scan = demo / "scan"
    write_tree_as_mat(scan / "Area_1", tmp_path / "other.mat")
    (tmp_path / "other.toml").write_text(scene_with(scan, tmp_path / "other.mat"))
    options = ["--views", "0", "--pano-width", "64", "--points-per-m2", "50", "--modalities", "pose"]
    s3d("export", scan / "scene.toml", "-o", tmp_path / "one", *options)
    s3d("export", tmp_path / "other.toml", "-o", tmp_path / "other", *options)
    for file in ["semantic.obj", "votes.json", "rooms.json", "instances.json", "instances.npz", "pointcloud.mat"]:
        one, other = [tmp_path / name / "area_1" / "3d" / file for name in ["one", "other"]]
        assert one.read_bytes() == other.read_bytes(), file


def test_a_file_that_is_cut_off_is_told(s3d, demo, path, tmp_path):
    (tmp_path / "cut.mat").write_bytes(path.read_bytes()[:-1000])
    (tmp_path / "cut.toml").write_text(scene_with(demo / "scan", tmp_path / "cut.mat"))
    done = s3d("export", tmp_path / "cut.toml", "-o", tmp_path / "cut", code=1)
    assert "cut.mat" in done.stderr and "is cut off" in done.stderr
