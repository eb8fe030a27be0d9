"""Progress of long work: bars, log lines, or calls of a function."""

from __future__ import annotations

import importlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Union


log = logging.getLogger("s3d_py")

LINE_EVERY_S = 5.0


@dataclass(frozen=True)
class Task:
    """The progress of a piece of long work. Several pieces may be under way at the same time."""

    id: int
    """Identifies the piece."""
    what: str
    """The work: "rendering"."""
    unit: str
    """The unit that is counted: "images"."""
    total: int
    """The number of all units."""
    done: int
    """The number of finished units."""


Progress = Union[bool, Callable[[Task], object], None]
"""The argument `progress` of calls.

True: bars of tqdm if it is installed, otherwise a line in the log of `s3d_py` every five seconds. A function:
it is called with a `Task` about ten times a second, and cancels the call by returning False. False or None:
nothing. Warnings and finished work are logged to `s3d_py` in any case.
"""


class Sink:
    """Receives events from the compiled part."""

    def message(self, level: str, text: str) -> None:
        number = {"warning": logging.WARNING, "info": logging.INFO}.get(level, logging.DEBUG)
        log.log(number, "%s", text)

    def started(self, id: int, what: str, unit: str, total: int) -> None: ...

    def advanced(self, id: int, done: int) -> object: ...

    def ended(self, id: int) -> None: ...


class _Calls(Sink):
    """Calls a function with the tasks."""

    def __init__(self, call: Callable[[Task], object]) -> None:
        self.call = call
        self.tasks: dict[int, Task] = {}

    def started(self, id: int, what: str, unit: str, total: int) -> None:
        self.tasks[id] = Task(id, what, unit, total, 0)

    def advanced(self, id: int, done: int) -> object:
        task = self.tasks[id]
        self.tasks[id] = Task(id, task.what, task.unit, task.total, done)
        return self.call(self.tasks[id])

    def ended(self, id: int) -> None:
        del self.tasks[id]


class _Bars(Sink):
    """Shows a bar of tqdm for each task."""

    def __init__(self, tqdm: Any) -> None:
        self.tqdm = tqdm
        self.bars: dict[int, Any] = {}

    def started(self, id: int, what: str, unit: str, total: int) -> None:
        self.bars[id] = self.tqdm(total=total, desc=what, unit=f" {unit}", leave=False, dynamic_ncols=True)

    def advanced(self, id: int, done: int) -> None:
        self.bars[id].update(done - self.bars[id].n)

    def ended(self, id: int) -> None:
        self.bars.pop(id).close()


class _Lines:
    """A function that logs the progress of a task every few seconds."""

    def __init__(self) -> None:
        self.last: dict[int, float] = {}

    def __call__(self, task: Task) -> None:
        now = time.monotonic()
        if now - self.last.setdefault(task.id, now) >= LINE_EVERY_S:
            self.last[task.id] = now
            log.info("%s: %d of %d %s", task.what, task.done, task.total, task.unit)


def sink(progress: Progress) -> Sink:
    """Returns the receiver of events for an argument `progress`."""
    if callable(progress):
        return _Calls(progress)
    if not progress:
        return Sink()
    try:
        return _Bars(importlib.import_module("tqdm.auto").tqdm)
    except ImportError:
        return _Calls(_Lines())
