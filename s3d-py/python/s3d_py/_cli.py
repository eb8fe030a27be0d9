"""The command `s3d`."""

from __future__ import annotations

import signal
import sys

from . import _native


def main() -> int:
    """Runs the command line of `s3d` with the arguments of this process, and returns the exit code."""
    # The command line handles Ctrl-C itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_command_line(["s3d", *sys.argv[1:]])
