"""Data sets in Rerun and FiftyOne. The tests run where those packages are installed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import s3d_py as s3d
from s3d_py._viewers import fiftyone_samples, instances_of


def test_a_missing_package_is_named(demo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = s3d.open(demo)
    calls: list[tuple[str, str, Callable[[], object]]] = [
        ("rerun", "rerun-sdk", data.to_rerun),
        ("fiftyone", "fiftyone", data.to_fiftyone),
    ]
    for name, install, call in calls:
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(s3d.UsageError, match=f"pip install {install}"):
            call()


def test_instances_of_an_image_are_told_apart() -> None:
    image = np.array([[-1, 7, 7, -1], [-1, 7, 3, 3], [-1, -1, -1, 3]], np.int32)
    found = {index: (box, mask.tolist()) for index, box, mask in instances_of(image)}
    assert found == {
        3: ([0.5, 1 / 3, 0.5, 2 / 3], [[True, True], [False, True]]),
        7: ([0.25, 0.0, 0.5, 2 / 3], [[True, True], [True, False]]),
    }
    assert list(instances_of(np.full((2, 2), -1, np.int32))) == []


def test_rerun_has_cameras_images_meshes_and_boxes(demo: Path, tmp_path: Path) -> None:
    rr: Any = pytest.importorskip("rerun")
    chunks: Any = pytest.importorskip("rerun.chunk")
    data = s3d.open(demo)
    views = [data.views()[0], data.panoramas()[0], data.views()[3]]
    path = tmp_path / "demo.rrd"
    recording = rr.RecordingStream("test")
    recording.save(path)
    data.to_rerun(views, recording=recording)
    recording.disconnect()

    rows: dict[tuple[str, int | None, str], Any] = {}
    for chunk in chunks.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        names = batch.schema.names
        for i in range(batch.num_rows):
            at = batch.column("image")[i].as_py() if "image" in names else None
            for name in names:
                if ":" in name and batch.column(name)[i].is_valid:
                    rows[chunk.entity_path, at, name] = batch.column(name)[i]

    for view in views:
        if view.K is None:
            place = "/panorama/area_1"
        else:
            place = "/world/area_1/camera"
            [translation] = rows[place, view.index, "Transform3D:translation"].as_py()
            assert np.allclose(translation, view.T_world_cam[:3, 3], atol=1e-5)
            [matrix] = rows[place, view.index, "Pinhole:image_from_camera"].as_py()
            # Columns come first.
            assert np.allclose(np.reshape(matrix, (3, 3)).T, view.K, atol=1e-3)
        [[*blob]] = rows[f"{place}/rgb", view.index, "EncodedImage:blob"].as_py()
        assert bytes(blob) == view.path("rgb").read_bytes()
        [[*classes]] = rows[f"{place}/classes", view.index, "SegmentationImage:buffer"].as_py()
        pixels = np.frombuffer(bytes(classes), np.uint16).reshape(view.size[::-1])
        assert (pixels == view.classes + 1).all()

    vertices = sum(len(row) for (_, _, name), row in rows.items() if name == "Mesh3D:vertex_positions")
    assert vertices == 3 * len(data.mesh().faces)
    labels = [row.as_py() for (_, _, name), row in rows.items() if name == "Boxes3D:labels"]
    assert sorted(label for part in labels for label in part) == sorted(i.label for i in data.instances())


def test_fiftyone_has_images_with_classes_and_instances(demo: Path) -> None:
    fo: Any = pytest.importorskip("fiftyone")
    data = s3d.open(demo)
    views = [data.views()[0], data.panoramas()[0]]
    for sample, view in zip(fiftyone_samples(data, views), views):
        assert sample.filepath == str(view.path("rgb")) and sample.room == view.room
        assert (sample.K is None) == view.is_panorama
        assert (sample.classes.mask == view.classes + 1).all()
        again = np.full(view.size[::-1], -1, np.int32)
        for found in sample.instances.detections:
            left, top, width, height = np.multiply(found.bounding_box, [*view.size, *view.size])
            rows, columns = round(top), round(left)
            part = again[rows : rows + round(height), columns : columns + round(width)]
            part[found.mask] = found.index
            label = data.labels[found.index]
            assert (found.label, found.instance_name) == (label.class_name, label.name)
        assert (again == view.instances).all()

    try:
        made = data.to_fiftyone(views)
    except fo.core.config.FiftyOneConfigError as error:
        pytest.skip(f"FiftyOne has no database here: {error}")
    try:
        assert len(made) == 2 and made.default_mask_targets[1] == (data.classes or [])[0]
    finally:
        made.delete()
