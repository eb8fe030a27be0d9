"""A data set with ScanNet's classes: in utils.py, in pycocotools, and in its panoptic images."""

import importlib.util
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

MODALITIES = "rgb,depth,normal,semantic,semantic_class,pose"


@pytest.fixture(scope="module")
def scannet(s3d, demo, tmp_path_factory):
    """The demo, with words of ScanNet's annotators for some of its objects."""
    scan = tmp_path_factory.mktemp("scan") / "scan"
    shutil.copytree(demo / "scan", scan)
    for old, new in [("table_1", "bed_1"), ("sofa_1", "couch_1"), ("bookcase_1", "shower curtain_1")]:
        files = sorted(scan.glob(f"Area_1/*/Annotations/{old}.txt"))
        assert files, old
        files[0].rename(files[0].with_name(f"{new}.txt"))
    scene = scan / "scene.toml"
    text = scene.read_text().replace("[annotations]\n", "[annotations]\nunknown_as_clutter = true\n")
    scene.write_text(f'taxonomy = "scannet20"\n{text}')
    out = tmp_path_factory.mktemp("scannet") / "dataset"
    small = ["--views", "4", "--size", "96", "--pano-width", "192", "--points-per-m2", "100"]
    s3d("export", scene, "-o", out, *small, "--modalities", MODALITIES)
    return out


@pytest.fixture(scope="module")
def coco(s3d, scannet, tmp_path_factory):
    place = tmp_path_factory.mktemp("coco") / "package"
    s3d("pack", scannet, "--to", "coco", "-o", place)
    return place


def taxonomy_of(out):
    return json.loads((out / "assets/taxonomy.json").read_text())


def test_utils_knows_the_classes(scannet):
    done = subprocess.run([sys.executable, "-W", "error", scannet / "assets/utils.py", scannet], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    spec = importlib.util.spec_from_file_location("utils", scannet / "assets/utils.py")
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    data = utils.Dataset(scannet)
    assert len(data.classes) == 20 and data.classes[15] == "showerCurtain" and data.taxonomy["name"] == "scannet20"
    seen = set()
    for image in data.images("pano") + data.images("data"):
        place = data.semantic_class(image)
        assert (place == data.class_of_label[data.semantic(image)]).all()
        seen |= set(np.unique(place))
        # The palette has the colours of the taxonomy.
        with Image.open(data.path(image, "semantic_class")) as file:
            rgb = np.asarray(file.convert("RGB"))
        colors = np.array([c["color"] for c in data.taxonomy["classes"]] + [[0, 0, 0]])
        assert (rgb == colors[place]).all()
    assert {data.classes.index(name) for name in ("wall", "floor", "chair", "bed", "showerCurtain")} <= seen
    assert -1 in seen and max(seen) < 20
    xyz, _, classes, _ = utils.read_s3dis_room(data.s3dis_rooms(1)[0], data.classes)
    assert len(xyz) == len(classes) and set(np.unique(classes)) <= set(range(20))


def test_pycocotools_reads_boxes_and_masks(coco, scannet):
    pytest.importorskip("pycocotools")
    from pycocotools.coco import COCO

    taxonomy = taxonomy_of(scannet)
    ids = {c["id"]: c["name"] for c in taxonomy["classes"]}
    things = {c["id"] for c in taxonomy["classes"] if c["kind"] == "thing"}
    data = COCO(str(coco / "instances.json"))
    assert set(data.getCatIds()) == things and all(data.cats[i]["name"] == ids[i] for i in things)
    assert data.getCatIds(catNms=["bed"]) == [4] and data.getImgIds(catIds=[4])
    panoptic = json.loads((coco / "panoptic.json").read_text())
    checked = 0
    for entry in panoptic["annotations"]:
        png = np.asarray(Image.open(coco / "panoptic" / entry["file_name"])).astype(np.int64)
        number = png[..., 0] + 256 * png[..., 1] + 65536 * png[..., 2]
        segments = [s for s in entry["segments_info"] if s["category_id"] in things]
        found = data.loadAnns(data.getAnnIds(imgIds=[entry["image_id"]]))
        assert len(found) == len(segments)
        for annotation, segment in zip(found, segments):
            assert annotation["category_id"] == segment["category_id"] and annotation["bbox"] == segment["bbox"]
            mask = data.annToMask(annotation)
            assert (mask == (number == segment["id"])).all() and mask.sum() == annotation["area"]
            checked += 1
    assert checked > 20


def test_panoptic_images_have_the_ids_of_the_taxonomy(coco, scannet):
    taxonomy = taxonomy_of(scannet)
    names = json.loads((scannet / "assets/semantic_labels.json").read_text())
    id_of = {c["name"]: c["id"] for c in taxonomy["classes"]}
    stuff = {c["id"] for c in taxonomy["classes"] if c["kind"] == "stuff"}
    panoptic = json.loads((coco / "panoptic.json").read_text())
    assert {c["id"]: c["name"] for c in panoptic["categories"]} == {i: n for n, i in id_of.items()}
    assert {c["id"] for c in panoptic["categories"] if not c["isthing"]} == stuff == {1, 2}
    seen = set()
    for entry in panoptic["annotations"]:
        png = np.asarray(Image.open(coco / "panoptic" / entry["file_name"])).astype(np.int64)
        number = png[..., 0] + 256 * png[..., 1] + 65536 * png[..., 2]
        semantic = np.asarray(Image.open(scannet / entry["file_name"].replace("rgb", "semantic"))).astype(np.int64)
        index = semantic[..., 0] * 65536 + semantic[..., 1] * 256 + semantic[..., 2]
        for segment in entry["segments_info"]:
            labels = {names[i] for i in np.unique(index[number == segment["id"]])}
            assert {id_of[name.split("_")[0]] for name in labels} == {segment["category_id"]}
            if segment["category_id"] in stuff:
                assert segment["id"] == 16_711_680 + segment["category_id"]
            else:
                assert labels == {names[segment["id"]]}
            seen.add(segment["category_id"])
    assert {1, 2, 4, 5, 6, 28} <= seen
