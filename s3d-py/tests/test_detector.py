"""The baseline detector, on a data set of points."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import s3d_py as s3d


def test_it_is_trained_kept_run_and_scored(demo: Path, tmp_path: Path) -> None:
    ds = s3d.open(demo)
    detector = s3d.Detector.train(ds, spaces="rooms", seed=1)
    assert detector.areas == [1] and detector.seed == 1 and "[1]" in repr(detector)
    detector.save(tmp_path / "model.json")
    words = ["detect", "train", str(demo), "-o", str(tmp_path / "same.json"), "--spaces", "rooms", "--seed", "1"]
    subprocess.run([sys.executable, "-m", "s3d_py", *words], check=True)
    assert (tmp_path / "model.json").read_bytes() == (tmp_path / "same.json").read_bytes()

    boxes = s3d.Detector.load(tmp_path / "model.json").run(ds, areas=[1])
    rooms = {room.name for room in ds.rooms}
    assert boxes and all(box.area == 1 and box.room in rooms for box in boxes)
    assert all(least <= largest for box in boxes for least, largest in zip(box.min, box.max))
    s3d.save_boxes(tmp_path / "found.json", boxes)
    # Detects in the areas of the training.
    assert ds.evaluate("det", tmp_path / "found.json").score("mean", "AP@0.25") > 0.2

    with pytest.raises(s3d.UsageError, match="no area 7"):
        detector.run(ds, areas=[7])
    with pytest.raises(s3d.UsageError, match="parsed, rooms"):
        s3d.Detector.train(ds, spaces="smell")
    with pytest.raises(s3d.MissingFileError):
        s3d.Detector.load(tmp_path / "gone.json")
