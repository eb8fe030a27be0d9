"""Fixtures of the tests that compare `s3d` with the readers and writers of other projects.

S3D_BIN names the binary; without it `cargo build` makes one. `s3d-cli/tests/python/run` installs what the tests need in
target/python and runs them all; its arguments go to pytest.
"""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

# A package that needs a missing library of the system fails with an OSError or an ImportError. pytest.importorskip does
# not count that as a missing package.
for name in ["open3d", "pye57"]:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        pass
    except (OSError, ImportError) as e:
        print(f"{name} cannot be loaded: {e}", file=sys.stderr)
        sys.modules[name] = None


@pytest.fixture(scope="session")
def s3d():
    """Runs the binary: `s3d("info", path)` gives its CompletedProcess and fails the test unless it ends with `code`."""
    binary = os.environ.get("S3D_BIN")
    if binary is not None:
        # Tests may change the working folder.
        binary = Path(binary).resolve()
    else:
        subprocess.run(["cargo", "build", "-q", "-p", "s3d-cli"], cwd=ROOT, check=True)
        binary = ROOT / "target" / "debug" / "s3d"

    def run(*arguments, code=0):
        done = subprocess.run([str(binary), *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == code, f"{arguments}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done

    run.binary = str(binary)
    return run


@pytest.fixture(scope="session")
def demo(s3d, tmp_path_factory):
    """The folder of the built-in scene's data set, exported small. Its input is in `scan`. Tests only read
    it.
    """
    out = tmp_path_factory.mktemp("demo") / "dataset"
    s3d("demo", "-o", out, "--views", "6", "--size", "96", "--pano-width", "256", "--points-per-m2", "400")
    return out
