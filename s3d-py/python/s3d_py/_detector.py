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
    """The room that most of its points are of: "office_5"."""
    class_name: str
    score: float
    """In context: comparable within a class."""
    min: tuple[float, float, float]
    """The least corner, world metres."""
    max: tuple[float, float, float]
    """The largest corner, world metres."""


class Detector:
    """A linear classifier a class on voxels of proposed boxes, with context (docs/detector.md): it reads the
    points of a data set alone, without labels.
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
        """Trains on areas of a `DataSet` or its folder; on all if none are named.

        - `spaces`: what is searched: "parsed", spaces that are found in the points, or annotated "rooms".
        - `most_spaces`: how many are learnt from at most, drawn at random: time and memory follow.

        The same areas and seed give the same detector for any number of threads. Raises `InputError` if
        nothing is annotated, `UsageError` for an area that is none.
        """
        root = root_of(dataset)
        return cls(
            _native.Detector.train(root, list(areas), spaces, most_spaces, seed, threads, sink(progress))
        )

    @classmethod
    def load(cls, path: PathLike) -> Detector:
        """Reads one that `save` or `s3d detect train` wrote."""
        return cls(_native.Detector.load(Path(path)))

    def save(self, path: PathLike) -> None:
        """Writes it as JSON; a file that is there is replaced."""
        self._native.save(Path(path))

    @property
    def areas(self) -> list[int]:
        """The areas that it was trained on."""
        return self._native.areas

    @property
    def seed(self) -> int:
        """The seed that it was trained with."""
        return self._native.seed

    def run(
        self,
        dataset: Any,
        *,
        areas: Sequence[int] = (),
        threads: int | None = None,
        progress: Progress = None,
    ) -> list[FoundBox]:
        """Finds the elements of areas of a `DataSet` or its folder; of all if none are named."""
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
    """Writes boxes as `evaluate("det", …)` and `s3d eval det` read them."""
    entries = [asdict(box) for box in boxes]
    for entry in entries:
        entry["class"] = entry.pop("class_name")
    Path(path).write_text(json.dumps(entries))
