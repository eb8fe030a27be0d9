"""Calls on whole data sets, and their results."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Union

from . import _native
from ._errors import UsageError
from ._progress import Progress, sink

PathLike = Union[str, os.PathLike[str]]


@dataclass(frozen=True)
class FaultGroup:
    """Faults of one kind."""

    topic: str
    """What they are about: "images against the mesh"."""
    kind: str
    """What they have in common, such as a modality."""
    count: int
    """How many there are."""
    first: list[tuple[str, str]]
    """The first twenty: the file, from the data set's folder, and what is wrong with it."""


@dataclass(frozen=True)
class VerifyReport:
    """What was found wrong in a data set."""

    faults: list[FaultGroup]
    notes: list[str]
    """What was left out, and why."""
    files: int
    """Files that were looked at."""
    checks: int
    """Checks that were made."""
    unread: str | None
    """What kept a file from being read that may be read the next time: the report is not complete."""
    text: str
    """What `s3d verify` prints."""

    @property
    def fault_count(self) -> int:
        """How many faults there are."""
        return sum(group.count for group in self.faults)

    @property
    def ok(self) -> bool:
        """Whether all was read, and nothing is wrong."""
        return not self.faults and self.unread is None

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"VerifyReport({self.fault_count} faults, {self.checks:,} checks of {self.files:,} files)"


class _Answer:
    """Data, and the same as text."""

    def __init__(self, data: Any, text: str) -> None:
        self.data, self.text = data, text

    data: Any
    """What the command writes as JSON."""
    text: str
    """What the command prints."""

    def __str__(self) -> str:
        return self.text


class Evaluation(_Answer):
    """Scores, with the definition that they follow. `data` is what `s3d eval --json` writes."""

    @property
    def definition(self) -> list[str]:
        """How it is counted, a sentence each."""
        return self.data["definition"]  # type: ignore[no-any-return]

    @property
    def tables(self) -> list[str]:
        """The titles of its tables: one a fold; with several folds, of all pooled and of the mean too."""
        return [table["title"] for table in self.data["tables"]]

    def score(self, row: str, column: str, table: str | None = None) -> float:
        """A score by the names of its row (a class, "mean", …), column ("IoU", …) and table, the last of
        `tables` by default; NaN where it is not defined.
        """
        title = self.tables[-1] if table is None else table
        for found in self.data["tables"]:
            rows = {entry["name"]: entry["scores"] for entry in found["rows"]}
            if found["title"] == title and row in rows and column in found["columns"]:
                value = rows[row][found["columns"].index(column)]["value"]
                return math.nan if value is None else float(value)
        raise UsageError(f"no score is called {row!r}, {column!r} in {title!r}: see str() of the evaluation")

    def __repr__(self) -> str:
        return f"Evaluation({self.data['protocol']} as {self.data['variant']}: {', '.join(self.tables)})"

    def _repr_markdown_(self) -> str:
        return self.text


class Comparison(_Answer):
    """What differs between two data sets. `data` is what `s3d compare --json` writes."""

    def __init__(self, equal: bool, data: Any, text: str) -> None:
        super().__init__(data, text)
        self.equal = equal

    equal: bool
    """Whether nothing differs, and all could be compared."""

    def __repr__(self) -> str:
        return f"Comparison({'equal' if self.equal else 'different'})"


class Statistics(_Answer):
    """The paper's tables. `data` is what `statistics.json` holds, `text` is Markdown."""

    def __repr__(self) -> str:
        return f"Statistics({len(self.data['areas'])} areas)"

    def _repr_markdown_(self) -> str:
        return self.text


def root_of(dataset: Any) -> Path:
    """The folder of a `DataSet`, or a path itself."""
    return Path(dataset if isinstance(dataset, (str, os.PathLike)) else dataset.root)


def info(
    scene: PathLike,
    *,
    see: float | None = None,
    place_cameras: float | None = None,
    lenient: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> str:
    """What a scene file, a mesh, or the folder of an area or a data set holds, how large a data set of it
    would be, and what looks wrong: what `s3d info` prints. `see` and `place_cameras` place scan locations, as
    `export` would.
    """
    return _native.info(Path(scene), see, place_cameras, lenient, threads, sink(progress))


def verify(
    dataset: Any, *, full: bool = False, threads: int | None = None, progress: Progress = None
) -> VerifyReport:
    """Reads every file of a data set (a `DataSet` or its folder) back, and renders every pixel of every image
    again. With `full` the candidate views are scored again as well, and the trees of points are compared.
    """
    faults, notes, files, checks, unread, text = _native.verify(
        root_of(dataset), full, threads, sink(progress)
    )
    groups = [FaultGroup(topic, kind, count, first) for topic, kind, count, first in faults]
    return VerifyReport(groups, notes, files, checks, unread, text)


def evaluate(
    protocol: str,
    truth: Any,
    pred: PathLike,
    *,
    variant: str | None = None,
    folds: str = "all",
    areas: Sequence[int] = (),
    bootstrap: int | None = None,
    seed: int = 0,
    median_scale: bool = False,
    images: str | None = None,
    classes: Sequence[str] | None = None,
    stuff: Sequence[str] | None = None,
    threads: int | None = None,
    progress: Progress = None,
) -> Evaluation:
    """Scores predictions by a protocol: "det", "sem3d", "inst-ap", "inst-cov", "sem-pano", "depth", "normal"
    or "panoptic".

    - `truth`: a `DataSet`, or its folder.
    - `pred`: the folder or file of predictions, in the forms that docs/evaluation.md describes.
    - `variant`: whose definition; the first of the protocol by default.
    - `folds`: "all" areas together, "each" for itself, or the three of the "paper"; or `areas`, together.
    - `bootstrap`: so many draws for 95 % intervals, by `seed`.
    - `median_scale` (depth), `images` (normal: "views" or "panoramas"), `classes` (det), `stuff`
      (panoptic): see the protocols.

    Raises `FileError` for a prediction that is missing, double, or of the wrong size.
    """
    how = SimpleNamespace(
        variant=variant,
        folds=folds,
        areas=list(areas),
        bootstrap=bootstrap,
        seed=seed,
        median_scale=median_scale,
        images=images,
        classes=None if classes is None else list(classes),
        stuff=None if stuff is None else list(stuff),
    )
    data, text = _native.evaluate(protocol, root_of(truth), Path(pred), how, threads, sink(progress))
    return Evaluation(json.loads(data), text)


def compare(
    a: Any, b: Any, *, full: bool = False, threads: int | None = None, progress: Progress = None
) -> Comparison:
    """What differs between two data sets, each a `DataSet` or its folder: options, files, labels by face,
    views, images, poses. With `full`, files whose listed checksums agree are read as well.
    """
    equal, data, text = _native.compare(root_of(a), root_of(b), full, threads, sink(progress))
    return Comparison(equal, json.loads(data), text)
