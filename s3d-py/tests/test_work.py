"""Progress, logs, and Ctrl-C during long calls."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import s3d_py as s3d


def test_a_function_is_told_how_far_work_is(room: s3d.Mesh) -> None:
    told: list[s3d.Task] = []
    s3d.sample(room, points=3_000_000, progress=told.append)
    assert told and all(t.what == "sampling" and t.unit == "points" and t.total == 3_000_000 for t in told)
    assert [t.done for t in told] == sorted(t.done for t in told) and told[-1].done == 3_000_000


def test_a_function_cancels_work(room: s3d.Mesh) -> None:
    told: list[s3d.Task] = []

    def stop(task: s3d.Task) -> bool:
        told.append(task)
        return False

    with pytest.raises(s3d.CancelledError, match="cancelled"):
        s3d.sample(room, points=10**9, progress=stop)
    assert told[-1].done < 10**9


def test_what_a_function_raises_ends_work(room: s3d.Mesh) -> None:
    def fail(_: s3d.Task) -> None:
        raise KeyError("a fault of the caller's")

    with pytest.raises(KeyError, match="a fault of the caller's"):
        s3d.sample(room, points=10**8, progress=fail)


def test_bars_are_drawn_where_tqdm_is(room: s3d.Mesh, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    s3d.sample(room, points=2_000_000, progress=True)
    assert "sampling" in capsys.readouterr().err
    s3d.sample(room, points=2_000_000)
    assert capsys.readouterr().err == ""


def test_warnings_come_to_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "twice.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 3\n")
    with caplog.at_level(logging.DEBUG, "s3d_py"):
        s3d.read_mesh(path)
    warnings = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert [(record.name, record.levelno) for record in warnings] == [("s3d_py", logging.WARNING)]
    assert "same corners" in caplog.text


def test_errors_are_pickled_with_their_place(tmp_path: Path) -> None:
    path = tmp_path / "bad.obj"
    path.write_text("v 0 0\n")
    with pytest.raises(s3d.FormatError) as caught:
        s3d.read_mesh(path)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert (
        type(copy) is s3d.FormatError
        and (copy.path, copy.line) == (str(path), 1)
        and str(copy) == str(caught.value)
    )


def test_python_runs_on_while_work_is_done(room: s3d.Mesh) -> None:
    ticks: list[float] = []
    stop = threading.Event()

    def tick() -> None:
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    s3d.sample(room, points=8_000_000, threads=1)
    ended = time.monotonic()
    stop.set()
    thread.join()
    # If a call kept Python's lock, there would be a gap as long as the call.
    during = [began, *(t for t in ticks if began < t < ended), ended]
    assert max(b - a for a, b in zip(during, during[1:])) < 0.5 * (ended - began)


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_ends_a_long_call() -> None:
    program = textwrap.dedent(
        """
        import s3d_py as s3d

        mesh = s3d.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        try:
            s3d.sample(mesh, points=100_000_000, progress=lambda task: print(task.done, flush=True))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        # Later calls work as before.
        print(len(s3d.sample(mesh, points=10)), flush=True)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert process.stdout
    assert int(process.stdout.readline()) < 100_000_000
    process.send_signal(signal.SIGINT)
    told = process.communicate(timeout=60)[0].split()
    assert process.returncode == 0 and told[-2:] == ["interrupted", "10"]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_rays_are_cast_in_parts_that_ctrl_c_ends(room: s3d.Mesh) -> None:
    scene = s3d.Scene(room)
    ways = np.random.default_rng(1).normal(size=(12_000_000, 3))
    began = time.monotonic()
    whole = scene.cast([2, 1.5, 1.2], ways, threads=1)
    took = time.monotonic() - began
    # Across the border of two parts.
    part = slice(2_000_000, 2_300_000)
    assert np.array_equal(whole.t[part], scene.cast([2, 1.5, 1.2], ways[part]).t)

    threading.Timer(0.1 * took, os.kill, [os.getpid(), signal.SIGINT]).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        scene.cast([2, 1.5, 1.2], ways, threads=1)
    assert time.monotonic() - began < 0.7 * took
