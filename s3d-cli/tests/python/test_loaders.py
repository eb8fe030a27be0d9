"""Files for the loaders of other projects, read as these do: label tables, S3DIS rooms, lists, and utils.py of the data set.

Each loader's *contract* is written anew here: which files it opens, how it parses them, in which type and order it looks
things up. Where the loader itself is installed (Open3D-ML comes with open3d), it is asked too.
"""

import importlib.util
import json
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

np = pytest.importorskip("numpy")

CLASSES = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split()
SMALL = ["--views", "4", "--size", "64", "--pano-width", "128", "--points-per-m2", "60"]
PROFILES = ["pointcept", "open3d-ml", "mmdet3d", "pointnet"]


@pytest.fixture(scope="module")
def scan(demo):
    return demo / "scan" / "scene.toml"


@pytest.fixture(scope="module")
def variant(s3d, scan, tmp_path_factory):
    """The demo in all other forms, with all profiles."""
    out = tmp_path_factory.mktemp("variant") / "dataset"
    options = ["--xyz", "float", "--normal-axes", "opencv", "--depth-units", "mm", "--pad-labels", "off"]
    profiles = [word for name in PROFILES for word in ("--profile", name)]
    s3d("export", scan, "-o", out, *SMALL, *options, *profiles)
    return out


def utils_of(out):
    spec = importlib.util.spec_from_file_location("utils", out / "assets/utils.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def read_image(path):
    return np.asarray(pytest.importorskip("PIL.Image").open(path))


def another_scene(scan, folder, area=1, keep_room=None):
    """Copies the demo's scan as another area, optionally with the annotations of one room only."""
    shutil.copytree(scan.parent, folder)
    scene = folder / "scene.toml"
    text = scene.read_text()
    assert "area = 1" in text
    scene.write_text(text.replace("area = 1", f"area = {area}"))
    if area != 1:
        table = folder / "cameras.csv"
        flip = str.maketrans("0123456789abcdef", "f0123456789abcde")
        lines = table.read_text().splitlines()
        table.write_text("".join(f"{u.translate(flip) if len(u) == 32 else u},{rest}\n" for u, rest in (l.split(",", 1) for l in lines)))
    if keep_room:
        rooms = [p.parent for p in folder.rglob("Annotations")]
        assert any(r.name == keep_room for r in rooms)
        for room in rooms:
            if room.name != keep_room:
                shutil.rmtree(room)
    return scene


# ---- Label tables -----------------------------------------------------------------------------------------------------


def class_table(out):
    """HoHoNet and 360BEV: a class number for every index of semantic_labels.json, 0 for none."""
    names = json.loads((out / "assets/semantic_labels.json").read_text())
    numbers = {name: i for i, name in enumerate(CLASSES, 1)}
    return np.array([numbers.get(name.split("_")[0], 0) for name in names])


def look_up(table, pixels):
    """They look up all pixels before they drop those with R."""
    pixels = pixels.astype(np.int32)
    found = table[pixels[..., 1] * 256 + pixels[..., 2]]
    found[pixels[..., 0] != 0] = 0
    return found


def test_labels_are_looked_up_before_they_are_masked(demo, variant):
    table = class_table(demo)
    assert len(table) == 3342 and json.loads((demo / "manifest.json").read_text())["labels_padded_to"] == 3342
    assert not look_up(table, np.full((2, 2, 3), 13, np.uint8)).any()
    utils = utils_of(demo)
    data = utils.Dataset(demo)
    seen = set()
    for image in data.images("pano"):
        found = look_up(table, read_image(data.path(image, "semantic")))
        assert np.array_equal(found - 1, data.class_of_label[data.semantic(image)])
        seen |= set(np.unique(found))
    assert len(seen) > 8
    with pytest.raises(IndexError):
        look_up(class_table(variant), np.full((2, 2, 3), 13, np.uint8))


@pytest.mark.parametrize("word, entries", [("off", 141), ("200", 200), ("5", 141)])
def test_padding_is_asked_for(s3d, scan, tmp_path, word, entries):
    s3d("export", scan, "-o", tmp_path / "out", *SMALL, "--modalities", "pose", "--pad-labels", word)
    names = json.loads((tmp_path / "out/assets/semantic_labels.json").read_text())
    assert len(names) == entries and set(names[141:]) <= {"<UNK>_0_<UNK>_0_0"}
    manifest = json.loads((tmp_path / "out/manifest.json").read_text())
    assert (manifest["labels"], manifest["labels_padded_to"]) == (141, entries)
    s3d("stats", tmp_path / "out")


def test_more_labels_than_loaders_tell_apart_are_refused(s3d, scan, tmp_path):
    scene = another_scene(scan, tmp_path / "scan", keep_room="office_1")
    annotations = next((tmp_path / "scan").rglob("Annotations"))
    for path in annotations.glob("clutter_*"):
        path.unlink()
    others = len(list(annotations.iterdir()))
    for number in range(1, 65_536 - others + 1):
        (annotations / f"clutter_{number}.txt").touch()
    done = s3d("export", scene, "-o", tmp_path / "out", code=1)
    assert "65536 labels are more than 65535" in done.stderr and "G and B" in done.stderr
    assert not (tmp_path / "out").exists()


# ---- Lists ------------------------------------------------------------------------------------------------------------


def unifuse_pairs(out, name):
    """UniFuse: a line names the colour image and the depth image relative to the root, with a space between.
    """
    return [line.strip().split(" ") for line in (out / "splits" / name).read_text().splitlines()]


def test_a_single_area_has_a_list_of_all_panoramas(demo):
    assert [p.name for p in (demo / "splits").iterdir()] == ["all.txt"]
    pairs = unifuse_pairs(demo, "all.txt")
    assert len(pairs) == len(list((demo / "area_1/pano/rgb").iterdir())) and pairs == sorted(pairs)
    for color, depth in pairs:
        assert color.replace("rgb", "depth") == depth
        rgb, gray = read_image(demo / color), read_image(demo / depth)
        assert rgb.shape == (*gray.shape, 3) and 0.2 < np.median(gray / 512) < 20


def test_folds_have_lists_of_both_sides(s3d, scan, tmp_path):
    five = another_scene(scan, tmp_path / "five", area=5)
    out = tmp_path / "out"
    s3d("export", scan, five, "-o", out, *SMALL, "--modalities", "rgb,depth,pose", "--profile", "pointcept")
    lists = {p.name: unifuse_pairs(out, p.name) for p in (out / "splits").iterdir()}
    # With areas 1 and 5, fold 1 (tests on 5) and fold 3 (trains on 2, 4, 5) have areas on both sides.
    assert set(lists) == {"all.txt", "fold_1_train.txt", "fold_1_test.txt", "fold_3_train.txt", "fold_3_test.txt"}
    areas = {name: {pair[0].split("/")[0] for pair in pairs} for name, pairs in lists.items()}
    assert areas["fold_1_train.txt"] == areas["fold_3_test.txt"] == {"area_1"}
    assert areas["fold_1_test.txt"] == areas["fold_3_train.txt"] == {"area_5"}
    assert sorted(lists["fold_1_train.txt"] + lists["fold_1_test.txt"]) == sorted(lists["all.txt"])
    assert all((out / path).is_file() for pairs in lists.values() for pair in pairs for path in pair)
    # Pointcept looks for the mesh of area 5 here.
    assert (out / "profiles/pointcept/raw/Area_5a/3d/rgb.obj").is_file()
    assert not (out / "profiles/pointcept/raw/Area_5").exists()


# ---- Rooms ------------------------------------------------------------------------------------------------------------


def annotations_of(room):
    """Returns the files of a room as loaders collect them, sorted."""
    return sorted(str(path) for path in (room / "Annotations").glob("*.txt"))


def class_of(path):
    return CLASSES.index(os.path.basename(path).split("_")[0])


def rooms(out):
    found = sorted(p for p in (out / "s3dis/Area_1").iterdir() if p.is_dir())
    assert len(found) == 4
    return found


def test_pointnet_arrays_are_what_its_script_makes(variant):
    folder = variant / "profiles/pointnet"
    listed = (folder / "meta/all_data_label.txt").read_text().split()
    assert sorted(listed) == sorted(p.name for p in (folder / "stanford_indoor3d").iterdir())
    assert (folder / "meta/anno_paths.txt").read_text().split()[0].endswith("/Annotations")
    for room in rooms(variant):
        parts = []
        for path in annotations_of(room):
            points = np.loadtxt(path, ndmin=2)
            parts.append(np.column_stack([points, np.full(len(points), class_of(path))]))
        expected = np.concatenate(parts)
        expected[:, :3] -= expected.min(axis=0)[:3]
        array = np.load(folder / f"stanford_indoor3d/Area_1_{room.name}.npy")
        assert array.dtype == np.float64 and np.array_equal(array, expected)  # to the last bit
        assert array[:, :3].min() == 0 and set(np.unique(array[:, 6])) <= set(range(13))


def test_mmdetection3d_arrays_are_what_its_script_makes(variant):
    pandas = pytest.importorskip("pandas")
    folder = variant / "profiles/mmdet3d"
    for area in range(1, 7):
        # Its converter finds the rooms of all six areas by their folders.
        listed = os.listdir(folder / f"Stanford3dDataset_v1.2_Aligned_Version/Area_{area}")
        assert len(listed) == (4 if area == 1 else 0)
    for room in rooms(variant):
        parts = []
        for number, path in enumerate(annotations_of(room), 1):
            points = pandas.read_csv(path, header=None, sep=" ").to_numpy()
            assert points.shape[1] == 6, "single spaces"
            parts.append(np.column_stack([points, np.full(len(points), class_of(path)), np.full(len(points), number)]))
        expected = np.concatenate(parts)
        expected[:, :3] -= expected.min(axis=0)[:3]
        stem = str(folder / f"s3dis_data/Area_1_{room.name}")
        points, classes, numbers = (np.load(f"{stem}_{kind}.npy") for kind in ("point", "sem_label", "ins_label"))
        assert (points.dtype, classes.dtype, numbers.dtype) == (np.float32, np.int64, np.int64)
        # pandas' own parser of decimals may be off by the last bit of a double.
        assert np.allclose(points, expected[:, :6].astype(np.float32), rtol=0, atol=2e-6)
        assert np.array_equal(classes, expected[:, 6]) and np.array_equal(numbers, expected[:, 7])
        assert numbers.min() == 1
        for number in range(1, numbers.max() + 1):
            kinds = classes[numbers == number]
            assert kinds.min() == kinds.max(), "an instance has one class, and points"


def pointcept_rooms(root, splits=range(1, 7)):
    """Pointcept's preprocessing: the areas of --splits, the rooms in their angle files, all annotations of
    each room.
    """
    found = {}
    for area in splits:
        table = np.loadtxt(root / f"Area_{area}" / f"Area_{area}_alignmentAngle.txt", dtype=str)
        for line in table:
            room, angle = f"Area_{area}/{line[0]}", int(line[1])
            paths = annotations_of(root / room)
            objects = [np.loadtxt(path) for path in paths]
            coords = np.vstack([o[:, :3] for o in objects])
            colors = np.vstack([o[:, 3:6] for o in objects])
            kinds = np.concatenate([np.full(len(o), class_of(path)) for o, path in zip(objects, paths)])
            found[room] = (coords, colors, kinds, angle)
    return found


@pytest.mark.filterwarnings("ignore:.*contained no data")
def test_pointcept_reads_its_tree(variant):
    root = variant / "profiles/pointcept"
    found = pointcept_rooms(root)
    assert set(found) == {f"Area_1/{room.name}" for room in rooms(variant)}
    for name, (coords, colors, kinds, angle) in found.items():
        assert len(coords) == len(kinds) > 100 and 0 <= angle < 90
        assert colors.min() >= 0 and colors.max() <= 255
    assert set(pointcept_rooms(root, [1])) == set(found)  # `--splits Area_1`; up to 1.5.1 it read all six
    mesh = root / "raw/Area_1/3d/rgb.obj"
    assert mesh.read_bytes() == (variant / "area_1/3d/rgb.obj").read_bytes()


@pytest.mark.filterwarnings("ignore:.*contained no data")
def test_pointcept_and_an_area_with_one_room_and_instances_of_one_point(s3d, scan, tmp_path):
    scene = another_scene(scan, tmp_path / "scan", keep_room="office_1")
    out = tmp_path / "out"
    sparse = ["--views", "0", "--size", "64", "--pano-width", "64", "--modalities", "pose", "--points-per-m2", "2"]
    done = s3d("export", scene, "-o", out, *sparse, "--profile", ",".join(PROFILES))
    assert "area 1 has one room" in done.stderr and "Pointcept" in done.stderr
    tree = tmp_path / "tree"
    shutil.copytree(out / "s3dis", tree)
    single = [p for p in tree.rglob("Annotations/*.txt") if len(p.read_text().splitlines()) == 1]
    assert single, "no instance of one point to try"
    for area in range(2, 7):  # all else that it needs
        (tree / f"Area_{area}").mkdir()
        (tree / f"Area_{area}" / f"Area_{area}_alignmentAngle.txt").write_text("## no room\n")
    with pytest.raises(ValueError):  # its angle: the second letter of "office_1"
        pointcept_rooms(tree)
    found = pointcept_rooms(out / "profiles/pointcept")
    assert list(found) == ["Area_1/office_1"]
    total = sum(len(p.read_text().splitlines()) for p in tree.rglob("Annotations/*.txt"))
    assert len(found["Area_1/office_1"][0]) == total + len(single)
    assert len(np.load(out / "profiles/pointnet/stanford_indoor3d/Area_1_office_1.npy")) == total


def test_open3d_ml_pickles(variant):
    folder = variant / "profiles/open3d-ml/original_pkl"
    for room in rooms(variant):
        with open(folder / f"Area_1_{room.name}.pkl", "rb") as file:
            points, boxes = pickle.load(file)
        paths = annotations_of(room)
        parts = [np.loadtxt(path, ndmin=2) for path in paths]
        expected = np.concatenate([np.column_stack([p, np.full(len(p), class_of(q))]) for p, q in zip(parts, paths)])
        assert points.dtype == np.float64 and np.array_equal(points, expected)
        assert not np.isnan(points).any(1).any() and len(boxes) == len(paths)
        for (name, x, y, z, w, h, l, yaw), path, part in zip(boxes, paths, parts):
            assert CLASSES[class_of(path)] == name and abs(yaw) <= np.pi / 2 + 1e-9
            first, second = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
            off = part[:, :2] - [x, y]
            for axis, extent in ((first, w), (second, l)):
                along = off @ axis
                assert np.isclose(along.max(), extent / 2, atol=1e-9) and np.isclose(along.min(), -extent / 2, atol=1e-9)
            assert np.isclose(h, np.ptp(part[:, 2])) and np.isclose(z, (part[:, 2].min() + part[:, 2].max()) / 2)
            if len(part) > 1:
                # Along principal axes, the coordinates are uncorrelated, and the first axis has the largest
                # spread.
                centred = off - off.mean(axis=0)
                cov = centred.T @ centred / len(part)
                assert abs(first @ cov @ second) < 1e-9 and first @ cov @ first >= second @ cov @ second - 1e-12


def test_open3d_ml_itself_reads_them(variant):
    """The data set class that comes with open3d."""
    probe = (
        "import sys\n"
        "from open3d._ml3d.datasets.s3dis import S3DIS\n"
        "data = S3DIS(dataset_path=sys.argv[1], test_area_idx=5)\n"
        "split = data.get_split('all')\n"
        "rooms = [split.get_data(i) for i in range(len(split))]\n"
        "print(len(rooms), sum(len(r['point']) for r in rooms), sum(len(r['bounding_boxes']) for r in rooms))\n"
    )
    folder = variant / "profiles/open3d-ml"
    done = subprocess.run([sys.executable, "-c", probe, str(folder)], capture_output=True, text=True)
    last = done.stderr.splitlines()[-1:]
    if done.returncode != 0 and last and last[0].startswith(("ModuleNotFoundError", "ImportError", "OSError")):
        pytest.skip("open3d's ml3d is not there: " + done.stderr.splitlines()[-1])
    assert done.returncode == 0, done.stderr
    found, points, boxes = map(int, done.stdout.split()[-3:])
    lines = [p for p in (variant / "s3dis").rglob("Annotations/*.txt")]
    furniture = [p for p in lines if p.name.split("_")[0] not in ("wall", "floor", "ceiling", "beam", "column", "clutter")]
    assert (found, boxes) == (4, len(furniture))
    assert points == sum(len(p.read_text().splitlines()) for p in lines)


def test_profiles_of_an_existing_data_set_are_the_same(s3d, scan, variant, tmp_path):
    out = tmp_path / "out"
    s3d("export", scan, "-o", out, *SMALL, "--modalities", "pose")
    assert not (out / "profiles").exists()
    s3d("profile", out, *(word for name in PROFILES for word in ("--to", name)))
    files = lambda root: {p.relative_to(root): p.read_bytes() for p in root.rglob("*") if p.is_file()}
    assert files(out / "profiles") == files(variant / "profiles")
    assert json.loads((out / "manifest.json").read_text())["options"]["profiles"] == sorted(PROFILES)
    done = s3d("profile", out, "--to", "pointnet", code=2)
    assert "profiles/pointnet is there already" in done.stderr
    s3d("profile", out, "--to", "pointnet", "--overwrite")
    assert files(out / "profiles") == files(variant / "profiles")
    # Another export removes all of it.
    s3d("export", scan, "-o", out, *SMALL, "--modalities", "pose", "--overwrite")
    assert not (out / "profiles").exists()


# ---- How a data set describes itself ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["demo", "variant"])
def test_utils_reads_all_of_it(request, name):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    out = request.getfixturevalue(name)
    done = subprocess.run(
        [sys.executable, "-W", "error", out / "assets/utils.py", out], capture_output=True, text=True
    )
    assert done.returncode == 0 and done.stdout.endswith("all as it should be\n"), done.stdout + done.stderr
    assert "Warning" not in done.stderr


def test_utils_reads_a_data_set_without_labels(s3d, demo, tmp_path):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    out = tmp_path / "out"
    s3d("export", demo / "scan/rgb.obj", "-o", out, "--views", "4", "--size", "96", "--pano-width", "256", "--points-per-m2", "50")
    done = subprocess.run(
        [sys.executable, "-W", "error", out / "assets/utils.py", out], capture_output=True, text=True
    )
    assert done.returncode == 0 and "0 instances, 0 rooms" in done.stdout, done.stdout + done.stderr
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((out / "assets/schema/manifest.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(json.loads((out / "manifest.json").read_text()))
    data = utils_of(out).Dataset(out)
    assert not data.is_labelled and len(data.labels) == 1
    # Every room of the building has a location.
    places = np.array([data.pose(image)["camera_location"] for image in data.images("pano")])
    for room in json.loads((demo / "area_1/3d/rooms.json").read_text()):
        outer = np.array(room["outline"][0]["outer"])
        inside = ((places[:, :2] > outer.min(axis=0)) & (places[:, :2] < outer.max(axis=0))).all(axis=1)
        assert inside.any(), room["room"]


def test_votes_are_those_of_the_labels(demo):
    utils = utils_of(demo)
    votes = utils.read_votes(demo / "area_1/3d/votes.npz")
    _, _, materials = utils.read_obj(demo / "area_1/3d/semantic.obj")
    names = json.loads((demo / "assets/semantic_labels.json").read_text())
    assert [names[i] for i in votes["label"]] == materials
    assert (votes["votes"] >= votes["runner_up_votes"]).all()
    assert (votes["votes"] + votes["runner_up_votes"] <= votes["total"]).all()
    told = json.loads((demo / "area_1/3d/votes.json").read_text())
    assert (votes["total"] == 0).sum() == told["faces_without_votes"]
    disputed = (votes["total"] > 0) & (votes["votes"] < 0.75 * votes["total"])
    assert disputed.sum() == sum(pair["faces"] for pair in told["disputing_classes"])
    assert 0 < len(told["disputed_patches"]) <= 50


def test_utils_finds_what_is_wrong(demo, tmp_path):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    out = tmp_path / "out"
    shutil.copytree(demo, out, ignore=shutil.ignore_patterns("scan"))
    # The depth has another unit than conventions.json says.
    path = out / "conventions.json"
    path.write_text(path.read_text().replace('"units_per_m": 512.0', '"units_per_m": 1000.0'))
    done = subprocess.run([sys.executable, out / "assets/utils.py", out], capture_output=True, text=True)
    assert done.returncode == 1 and "depth and coordinates are" in done.stdout


def test_options_change_what_they_say_and_nothing_else(s3d, scan, variant, tmp_path):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    plain = tmp_path / "plain"
    s3d("export", scan, "-o", plain, *SMALL)
    utils = utils_of(plain)
    a, b = utils.Dataset(plain), utils.Dataset(variant)
    for kind in ("pano", "data"):
        images = a.images(kind)
        assert images == b.images(kind) and images
        for image in images[:6]:
            for same in ("rgb", "semantic", "semantic_pretty", "pose"):
                assert a.path(image, same).read_bytes() == b.path(image, same).read_bytes()
            depths = a.depth(image), b.depth(image)
            assert np.array_equal(np.isnan(depths[0]), np.isnan(depths[1]))
            assert np.nanmax(np.abs(depths[0] - depths[1])) <= 0.5 / 512 + 0.5 / 1000 + 1e-6
            raw = read_image(b.path(image, "depth"))
            assert np.array_equal(np.round(depths[1][raw < 65535] * 1000), raw[raw < 65535])
            assert (a.xyz(image).dtype, b.xyz(image).dtype) == (np.float16, np.float32)
            seen = ~np.isnan(depths[0])
            assert np.array_equal(a.xyz(image)[seen], b.xyz(image)[seen].astype(np.float16))
            # The normals are the same in the world, whatever their axes in the file, within half a step of
            # 127.5 in each channel.
            assert np.nanmax(np.abs(a.world_normals(image) - b.world_normals(image))) < 0.02
            channels = [read_image(d.path(image, "normal"))[seen].astype(int) for d in (a, b)]
            if kind == "pano":
                assert np.array_equal(*channels)
            else:
                assert np.array_equal(channels[0][:, :2], channels[1][:, :2])
                assert set(np.unique(channels[0][:, 2] + channels[1][:, 2])) <= {255, 256}, "towards, and away"
                assert (channels[0][:, 2] > channels[1][:, 2]).mean() > 0.8


def test_coordinates_are_made_again_from_depth(s3d, scan, tmp_path):
    pytest.importorskip("OpenEXR")
    pytest.importorskip("PIL")
    full, none = tmp_path / "full", tmp_path / "none"
    s3d("export", scan, "-o", full, *SMALL, "--xyz", "float")
    s3d("export", scan, "-o", none, *SMALL, "--xyz", "none")
    assert not (none / "area_1/data/global_xyz").exists()
    loss = json.loads((none / "manifest.json").read_text())["areas"][0]["xyz"]
    assert loss["type"] == "none" and loss["largest_step_m"] is None
    s3d("xyz", none, "--type", "float")
    utils = utils_of(full)
    a, b = utils.Dataset(full), utils.Dataset(none)
    assert b.conventions["global_xyz"]["type"] == "float"
    assert b.manifest["xyz_from_depth"] == {"type": "float", "depth_step_m": 1 / 512, "largest_depth_m": 65534 / 512}
    for kind in ("pano", "data"):
        for image in a.images(kind):
            exact, made, depth = a.xyz(image), b.xyz(image), a.depth(image)
            assert np.array_equal(np.isnan(made), np.isnan(exact))
            rays = np.linalg.norm(exact - np.array(a.pose(image)["camera_location"]), axis=-1)
            off = np.linalg.norm(made - exact, axis=-1)
            assert np.nanmax(off / (rays / depth)) <= 0.5 / 512 + 2e-5
            assert np.nanmax(np.abs(made - b.world_points(image))) < 1e-5
    assert "is there already" in s3d("xyz", none, code=2).stderr
    s3d("xyz", none, "--overwrite")
    image = a.images("data")[0]
    assert utils.Dataset(none).xyz(image).dtype == np.float16


@pytest.mark.parametrize("name", ["demo", "variant"])
def test_schemas_hold(request, name):
    jsonschema = pytest.importorskip("jsonschema")
    out = request.getfixturevalue(name)
    read = lambda path: json.loads(path.read_text())
    schema = {kind: read(out / f"assets/schema/{kind}.schema.json") for kind in ("pose", "manifest")}
    check = {}
    for kind, content in schema.items():
        jsonschema.Draft202012Validator.check_schema(content)
        check[kind] = jsonschema.Draft202012Validator(content)
    manifest = read(out / "manifest.json")
    check["manifest"].validate(manifest)
    # Every key must be described, so that the schema does not miss a new one.
    assert set(manifest) <= set(schema["manifest"]["properties"])
    options = schema["manifest"]["properties"]["options"]["properties"]
    assert set(manifest["options"]) == set(options) - {"fill", "trim_strays", "rgb_samples", "semantic_glb"}
    area = schema["manifest"]["properties"]["areas"]["items"]["properties"]
    # An area whose scan lies near the origin has no offset, one whose locations are listed does not place them, and here are
    # no photographs; nothing is warned of.
    rare = {"offset_m", "see", "surface_seen", "frames", "warnings"}
    assert all(set(entry) == set(area) - rare for entry in manifest["areas"])
    poses = sorted(out.glob("area_1/*/pose/*.json"))
    assert len(poses) > 5
    for path in poses:
        pose = read(path)
        check["pose"].validate(pose)
        assert set(pose) == set(schema["pose"]["properties"]) - {"world_offset_m"}
    for key, value in (("frame_num", -1), ("camera_location", [1, 2]), ("room", "kitchen_1_1"), ("camera_uuid", "a_b")):
        with pytest.raises(jsonschema.ValidationError):
            check["pose"].validate({**pose, key: value})
    with pytest.raises(jsonschema.ValidationError):
        check["manifest"].validate({**manifest, "status": "done"})
    published = Path(__file__).resolve().parents[4] / "shared/spec/pose-office_5.json"
    if published.exists():
        check["pose"].validate(read(published)["pose"])


def test_a_manifest_after_s3d_xyz_holds_too(s3d, scan, tmp_path):
    jsonschema = pytest.importorskip("jsonschema")
    out = tmp_path / "out"
    s3d("export", scan, "-o", out, *SMALL, "--xyz", "none", "--modalities", "depth,pose")
    manifest = lambda: json.loads((out / "manifest.json").read_text())
    schema = json.loads((out / "assets/schema/manifest.schema.json").read_text())
    jsonschema.validate(manifest(), schema)
    s3d("xyz", out)
    jsonschema.validate(manifest(), schema)
    assert manifest()["xyz_from_depth"]["type"] == "half"
