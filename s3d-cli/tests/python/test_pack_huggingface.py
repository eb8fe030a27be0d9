"""Reads `s3d pack --to huggingface` with `datasets`, and its Croissant file with MLCommons' validator."""

import io
import json
import os

import pytest
from test_pack import array, image_path, labels_of, pack, pose_of, stems  # noqa: F401

np = pytest.importorskip("numpy")
Image = pytest.importorskip("PIL.Image")

# Nothing is looked up on the Hub.
os.environ.setdefault("HF_HUB_OFFLINE", "1")
PNG = ["rgb", "depth", "normal", "semantic", "semantic_pretty"]


@pytest.fixture(scope="module")
def package(pack):  # noqa: F811
    return pack("huggingface")


def stem_of(row):
    frame = "equirectangular" if row["kind"] == "panorama" else row["frame_num"]
    return f"camera_{row['camera_uuid']}_{row['room']}_frame_{frame}"


@pytest.mark.parametrize("config, kind", [(None, "data"), ("panoramas", "pano")])
def test_every_column_of_every_image_is_decoded(package, demo, tmp_path, config, kind):
    datasets = pytest.importorskip("datasets")
    found = datasets.load_dataset(str(package), config, cache_dir=str(tmp_path))
    assert list(found) == ["area_1"]
    table = found["area_1"]
    assert table.features["depth"] == datasets.Image(mode="F")
    assert table.features["rgb"] == datasets.Image()
    assert sorted(map(stem_of, table)) == stems(demo, kind)
    for row in table:
        stem = stem_of(row)
        for domain in PNG:
            image = np.asarray(row[domain])
            expected = array(image_path(demo, stem, domain))
            assert image.dtype == (np.float32 if domain == "depth" else np.uint8)
            assert (image == expected).all()
        k, rt, pose = pose_of(demo, stem)
        assert (np.reshape(row["k"], (3, 3)) == k).all() and (np.reshape(row["rt"], (3, 4)) == rt).all()
        assert [row["x"], row["y"], row["z"]] == pose["camera_location"]
        label = labels_of(demo, stem)
        assert row["coverage"] == (label >= 0).mean()
        assert row["instances"] == len(np.unique(label[label > 0]))
        missing = [name for name, value in row.items() if value is None]
        of_views = ["frame_num", "yaw_rad", "pitch_rad", "selection_entropy"]
        assert missing == ([] if kind == "data" else of_views)


def test_the_card_has_the_features_of_the_files(package):
    datasets = pytest.importorskip("datasets")
    yaml = pytest.importorskip("yaml")
    pq = pytest.importorskip("pyarrow.parquet")
    _, head, page = (package / "README.md").read_text().split("---\n", 2)
    card = yaml.safe_load(head)
    assert [c["config_name"] for c in card["configs"]] == ["views", "panoramas"]
    assert card["configs"][0]["default"] is True and card["license"] == "unknown"
    for config, info in zip(card["configs"], card["dataset_info"]):
        told = datasets.Features._from_yaml_list(info["features"])
        for file in config["data_files"]:
            paths = list(package.glob(file["path"]))
            assert paths
            for path in paths:
                assert datasets.Features.from_arrow_schema(pq.read_schema(path)) == told
    assert all(f"| `{name}` |" in page for name in told)


def test_only_what_is_asked_for_becomes_columns(pack, s3d, demo, tmp_path):  # noqa: F811
    pq = pytest.importorskip("pyarrow.parquet")
    place = pack("huggingface", "--modalities", "depth,rgb", "--images", "views")
    assert not (place / "data" / "panoramas").exists()
    names = pq.read_schema(next(place.glob("data/views/*.parquet"))).names
    assert [name for name in names if name in [*PNG, "global_xyz", "pose"]] == ["rgb", "depth"]
    call = ["pack", demo, "--to", "huggingface", "-o", tmp_path / "p", "--modalities"]
    refusals = [("global_xyz", "OpenEXR"), ("pose", "which are always there"), ("objects", "missing")]
    for domain, reason in refusals:
        told = s3d(*call, domain, code=1 if domain == "objects" else 2)
        assert reason in told.stderr and not (tmp_path / "p").exists()


def test_croissant_is_valid_and_leads_to_the_images(package, demo):
    croissant = pytest.importorskip("mlcroissant")
    path = package / "croissant.json"
    dataset = croissant.Dataset(jsonld=str(path))
    assert not dataset.metadata.ctx.issues.errors
    told = json.loads(path.read_text())
    assert {r["@id"] for r in told["recordSet"]} == {"views", "panoramas"}
    seen = []
    for record in dataset.records("views"):
        record = {name.removeprefix("views/"): value for name, value in record.items()}
        names = ["kind", "camera_uuid", "room"]
        text = {n: record[n].decode() if isinstance(record[n], bytes) else record[n] for n in names}
        stem = stem_of({**text, "frame_num": int(record["frame_num"])})
        image = record["rgb"]
        image = Image.open(io.BytesIO(image)) if isinstance(image, bytes) else image
        assert (np.asarray(image) == array(image_path(demo, stem, "rgb"))).all()
        seen.append(stem)
    assert sorted(seen) == stems(demo, "data")
