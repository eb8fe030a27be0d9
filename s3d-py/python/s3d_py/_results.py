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
    """The subject: "images against the mesh"."""
    kind: str
    """What the faults have in common, such as a modality."""
    count: int
    """The number of faults."""
    first: list[tuple[str, str]]
    """The first twenty: the file, relative to the data set's folder, and its fault."""


@dataclass(frozen=True)
class VerifyReport:
    """The faults found in a data set."""

    faults: list[FaultGroup]
    notes: list[str]
    """Omitted checks, and why."""
    files: int
    """The number of files read."""
    checks: int
    """The number of checks."""
    unread: str | None
    """The reason why a file could not be read that may be readable the next time; the report is incomplete
    then.
    """
    text: str
    """The output of `s3d verify`."""

    @property
    def fault_count(self) -> int:
        """The number of faults."""
        return sum(group.count for group in self.faults)

    @property
    def ok(self) -> bool:
        """Whether all was read and no fault was found."""
        return not self.faults and self.unread is None

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"VerifyReport({self.fault_count} faults, {self.checks:,} checks of {self.files:,} files)"


class _Answer:
    """A result as data and as text."""

    def __init__(self, data: Any, text: str) -> None:
        self.data, self.text = data, text

    data: Any
    """The data that the command writes as JSON."""
    text: str
    """The text that the command prints."""

    def __str__(self) -> str:
        return self.text


class Evaluation(_Answer):
    """Scores, with their definition. `data` is what `s3d eval --json` writes."""

    @property
    def definition(self) -> list[str]:
        """The definition of the scores, a sentence each."""
        return self.data["definition"]  # type: ignore[no-any-return]

    @property
    def tables(self) -> list[str]:
        """The titles of the tables: one for each fold, and with several folds one for all pooled and one for
        the mean. Scores of panoramas have each of these twice: the second is weighted by latitude.
        """
        return [table["title"] for table in self.data["tables"]]

    def score(self, row: str, column: str, table: str | None = None) -> float:
        """Returns the score with these names: its row (a class, "mean", …), its column ("IoU", …) and its
        table, by default the last of `tables` that is not weighted by latitude. NaN if it is not defined.
        """
        plain = [title for title in self.tables if not title.endswith(", weighted by latitude")]
        title = plain[-1] if table is None else table
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
    """The differences between two data sets. `data` is what `s3d compare --json` writes."""

    def __init__(self, equal: bool, data: Any, text: str) -> None:
        super().__init__(data, text)
        self.equal = equal

    equal: bool
    """Whether all could be compared and nothing differs."""

    def __repr__(self) -> str:
        return f"Comparison({'equal' if self.equal else 'different'})"


class Statistics(_Answer):
    """The paper's tables. `data` is the content of `statistics.json`, `text` is Markdown."""

    def __repr__(self) -> str:
        return f"Statistics({len(self.data['areas'])} areas)"

    def _repr_markdown_(self) -> str:
        return self.text


def root_of(dataset: Any) -> Path:
    """Returns the folder of a `DataSet`, or a path itself."""
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
    """Describes a scene file, a mesh, or the folder of an area or data set: its content, the size of a data
    set made from it, and what looks wrong. Returns the output of `s3d info`. `see` and `place_cameras` place
    scan locations, as in `export`.
    """
    return _native.info(Path(scene), see, place_cameras, lenient, threads, sink(progress))


def verify(
    dataset: Any, *, full: bool = False, threads: int | None = None, progress: Progress = None
) -> VerifyReport:
    """Reads back every file of a data set (a `DataSet` or its folder), and renders every pixel of every image
    again. With `full`, candidate views are scored again too, and the trees of points are compared.
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
    against: PathLike | None = None,
    bootstrap: int | None = None,
    seed: int = 0,
    median_scale: bool = False,
    images: str | None = None,
    classes: Sequence[str] | None = None,
    boxes: str | None = None,
    stuff: Sequence[str] | None = None,
    threads: int | None = None,
    progress: Progress = None,
) -> Evaluation:
    """Scores predictions by a protocol: "det", "sem3d", "inst-ap", "inst-cov", "sem-pano", "sem-view",
    "sem-edge", "depth", "depth-edge", "normal", "panoptic" or "panoptic3d".

    - `truth`: a `DataSet`, or its folder.
    - `pred`: the folder or file of predictions. The page "Evaluation" of the documentation describes its
      forms.
    - `variant`: the definition to follow; by default the first of the protocol.
    - `folds`: "all" areas together, "each" area by itself, or the three folds of the "paper".
    - `areas`: score these areas together instead.
    - `against`: other predictions in the same form. `data["against"]["differences"]` has the difference of
      each score with its interval, over 1,000 draws of the same rooms or images for both, or `bootstrap`.
    - `bootstrap`: the number of draws for 95 % intervals, drawn by `seed`.
    - `median_scale` (depth), `images` ("views" or "panoramas", of protocols that are of both), `classes` and
      `boxes` (det: "points" or "annotations"), `stuff` (panoptic, panoptic3d): see the protocols.

    Raises `FileError` for a prediction that is missing, duplicate, or of the wrong size.
    """
    how = SimpleNamespace(
        variant=variant,
        folds=folds,
        areas=list(areas),
        against=None if against is None else Path(against),
        bootstrap=bootstrap,
        seed=seed,
        median_scale=median_scale,
        images=images,
        classes=None if classes is None else list(classes),
        boxes=boxes,
        stuff=None if stuff is None else list(stuff),
    )
    data, text = _native.evaluate(protocol, root_of(truth), Path(pred), how, threads, sink(progress))
    return Evaluation(json.loads(data), text)


def compare(
    a: Any, b: Any, *, full: bool = False, threads: int | None = None, progress: Progress = None
) -> Comparison:
    """Compares two data sets, each a `DataSet` or its folder: options, files, labels by face, views, images,
    poses. With `full`, files whose listed checksums agree are read as well.
    """
    equal, data, text = _native.compare(root_of(a), root_of(b), full, threads, sink(progress))
    return Comparison(equal, json.loads(data), text)
