"""Runs the notebooks one after the other, starting in an empty folder. They assert their own claims."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
NEEDS = {"segmentation": ["sklearn", "PIL"], "rendered": ["sklearn"]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("notebooks")


@pytest.mark.parametrize("notebook", sorted(path.stem for path in NOTEBOOKS.glob("*.py")))
def test_a_notebook(notebook: str, folder: Path) -> None:
    for module in NEEDS.get(notebook, []):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    run = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", NOTEBOOKS / f"{notebook}.py"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert len(run.stdout.splitlines()) >= 3


def test_there_are_seven() -> None:
    assert len(list(NOTEBOOKS.glob("*.py"))) == 7
