"""Scenes shared by the tests."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

import s3d_py as s3d

from common import box

# A shell that starts the tests in the background has them ignore it, and so would the programs that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def room() -> s3d.Mesh:
    """A closed room of 4 × 3 × 2.5 m with a table: 14 faces."""
    return box()


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in scene as files in scan/, and its data set."""
    folder = tmp_path_factory.mktemp("demo") / "demo"
    words = ["demo", "-o", str(folder), "--views", "8", "--size", "160", "--pano-width", "256", "--quiet"]
    subprocess.run([sys.executable, "-m", "s3d_py", *words], check=True)
    return folder
