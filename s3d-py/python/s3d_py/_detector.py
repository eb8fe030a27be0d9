"""The paper's baseline detector of objects."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from . import _native
from ._progress import Progress, sink
from ._results import PathLike, root_of


@dataclass(frozen=True)
class FoundBox:
    """An element that a detector found."""

    area: int
    room: str
    """The room of most of its points: "office_5"."""
    class_name: str
    score: float
    """The score in context, comparable within a class."""
    min: tuple[float, float, float]
    """The smallest coordinates, in world metres."""
    max: tuple[float, float, float]
    """The largest coordinates, in world metres."""


class Detector:
    """A linear classifier for each class on the voxels of proposed boxes, with context. To detect, it reads
    only the points of a data set, not the labels. The page "The baseline detector" of the documentation
    explains it.
    """

    def __init__(self, native: _native.Detector) -> None:
        self._native = native

    @classmethod
    def train(
        cls,
        dataset: Any,
        *,
        areas: Sequence[int] = (),
        spaces: str = "parsed",
        most_spaces: int = 100,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress = None,
    ) -> Detector:
        """Trains on areas of a `DataSet` or its folder; on all areas if none are named.

        - `spaces`: the spaces to search: "parsed" spaces, found in the points, or annotated "rooms".
        - `most_spaces`: learn from at most this many spaces, drawn at random. Time and memory grow with it.

        The same areas and seed give the same detector for any number of threads. Raises `InputError` if
        nothing is annotated, and `UsageError` for an unknown area.
        """
        root = root_of(dataset)
        return cls(
            _native.Detector.train(root, list(areas), spaces, most_spaces, seed, threads, sink(progress))
        )

    @classmethod
    def load(cls, path: PathLike) -> Detector:
        """Reads a detector that `save` or `s3d detect train` wrote."""
        return cls(_native.Detector.load(Path(path)))

    def save(self, path: PathLike) -> None:
        """Writes the detector as JSON. An existing file is replaced."""
        self._native.save(Path(path))

    @property
    def areas(self) -> list[int]:
        """The areas it was trained on."""
        return self._native.areas

    @property
    def seed(self) -> int:
        """The seed it was trained with."""
        return self._native.seed

    def run(
        self,
        dataset: Any,
        *,
        areas: Sequence[int] = (),
        threads: int | None = None,
        progress: Progress = None,
    ) -> list[FoundBox]:
        """Finds the elements in areas of a `DataSet` or its folder; in all areas if none are named."""
        found = json.loads(self._native.run(root_of(dataset), list(areas), threads, sink(progress)))
        return [
            FoundBox(
                box["area"], box["room"], box["class"], box["score"], tuple(box["min"]), tuple(box["max"])
            )
            for box in found
        ]

    def __repr__(self) -> str:
        return f"Detector(of areas {self.areas}, seed {self.seed})"


def save_boxes(path: PathLike, boxes: Sequence[FoundBox]) -> None:
    """Writes boxes to a file that `evaluate("det", …)` and `s3d eval det` read."""
    entries = [asdict(box) for box in boxes]
    for entry in entries:
        entry["class"] = entry.pop("class_name")
    Path(path).write_text(json.dumps(entries))
