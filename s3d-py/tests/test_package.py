"""What every call has in common: versions, errors, the command line."""

from __future__ import annotations

import importlib
import importlib.metadata
import inspect
import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

import s3d_py as s3d

COMMAND = os.path.join(sysconfig.get_path("scripts"), "s3d")


def test_the_package_has_the_version_of_its_compiled_part() -> None:
    assert s3d.__version__ == importlib.metadata.version("s3d-py")
    assert all(hasattr(s3d, name) for name in s3d.__all__)


def test_everything_public_is_explained() -> None:
    for name in s3d.__all__:
        thing = getattr(s3d, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue
        assert thing.__doc__, name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_") and (inspect.isfunction(value) or hasattr(value, "__get__")):
                assert inspect.getdoc(value), f"{name}.{member}"


def test_messages_name_arguments_not_options(demo: Path, tmp_path: Path) -> None:
    with pytest.raises(s3d.UsageError, match="overwrite=True"):
        s3d.export(demo / "scan" / "scene.toml", demo, size=64)
    (tmp_path / "page").mkdir()
    (tmp_path / "page" / "letter.txt").write_text("mine")
    with pytest.raises(s3d.UsageError) as raised:
        s3d.open(demo).report(tmp_path / "page")
    assert "--" not in str(raised.value)
    with pytest.raises(s3d.UsageError, match=r"size \d+ there, 32 now"):
        s3d.export(demo / "scan" / "scene.toml", demo, size=32)
    with pytest.raises(s3d.UsageError, match="stuff belongs to coco only"):
        s3d.open(demo).pack("colmap", stuff=["wall"])


def test_options_of_an_export_are_those_of_the_crate() -> None:
    names = importlib.import_module("s3d_py._native").export_option_names()
    assert list(s3d.ExportOptions.__annotations__) == names


def test_errors_are_a_hierarchy() -> None:
    for kind, bases in {
        s3d.UsageError: (s3d.Error, ValueError),
        s3d.InputError: (s3d.Error, ValueError),
        s3d.MeshError: (s3d.FormatError, s3d.FileError, ValueError),
        s3d.MissingFileError: (s3d.FileAccessError, FileNotFoundError, s3d.FileError),
        s3d.TemporaryError: (s3d.Error,),
        s3d.CancelledError: (s3d.Error,),
    }.items():
        assert issubclass(kind, bases)


def test_the_command_is_that_of_the_binary(tmp_path: Path) -> None:
    def run(*words: str, module: bool = False) -> subprocess.CompletedProcess[str]:
        program = [sys.executable, "-m", "s3d_py"] if module else [COMMAND]
        return subprocess.run([*program, *words], capture_output=True, text=True, cwd=tmp_path)

    assert run("--version").stdout == f"s3d {s3d.__version__}\n"
    assert run("--version", module=True).stdout == f"s3d {s3d.__version__}\n"
    wrong = run("export")
    assert wrong.returncode == 2 and "Usage: s3d export" in wrong.stderr
    missing = run("info", "gone.glb")
    assert missing.returncode == 1 and "gone.glb" in missing.stderr


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_ends_the_command_as_it_does_the_binary(tmp_path: Path) -> None:
    words = [COMMAND, "demo", "-o", "demo"]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    while not (tmp_path / "demo" / "area_1").is_dir():
        assert process.poll() is None, process.stderr and process.stderr.read()
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    told = process.communicate(timeout=60)[1]
    assert process.returncode == 75, told
    # The command that a message recommends is the one that was called, not Python's.
    assert "stopped by SIGINT; go on with: s3d demo -o demo" in told and "Traceback" not in told


def test_the_licences_are_whole() -> None:
    texts = [str(file.read_text()) for file in importlib.metadata.files("s3d-py") or () if "LICENSE" in file.name]
    assert len(texts) == 2 and min(map(len, texts)) > 900
