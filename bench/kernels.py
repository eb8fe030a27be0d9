"""Where the processor time of a command goes: by stage and by kernel.

    python3 bench/kernels.py [--most N] export SCENE.toml -o OUT --threads 1 --overwrite

Builds s3d with names that tell kernels apart into target/kernels, runs the command under Linux' perf, and prints the
share of each crate and the functions with the largest shares. A vector kernel has the name of its type, and of the
instructions that it is compiled for. Needs perf (Debian: linux-perf).
"""

import collections
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "target/kernels"
SYSTEM = "operating system"
# The instructions that a kernel is compiled for, and what it is.
KERNEL = re.compile(r"<s3d_simd::(\w+)>::vectorize::compiled::<.*?\b(?:dispatch_on|run)<(.+)>::\{closure#\d\}>$")


def build():
    flags = {"RUSTFLAGS": "-C symbol-mangling-version=v0", "CARGO_PROFILE_RELEASE_DEBUG": "line-tables-only"}
    command = ["cargo", "build", "--release", "--locked", "-q", "-p", "s3d-cli", "--target-dir", str(TARGET)]
    subprocess.run(command, cwd=ROOT, check=True, env=os.environ | flags)
    return TARGET / "release/s3d"


def samples(binary, arguments):
    """The functions that samples fell into, with their counts."""
    with tempfile.NamedTemporaryFile(suffix=".perf") as data:
        record = ["perf", "record", "-q", "-F", "499", "-e", "cpu-clock", "-o", data.name, str(binary), *arguments]
        subprocess.run(record, check=True)
        report = ["perf", "report", "-i", data.name, "--stdio", "-q", "--no-children", "-F", "sample,dso,symbol"]
        text = subprocess.run(report, check=True, capture_output=True, text=True).stdout
    counts = collections.Counter()
    for line in text.splitlines():
        found = re.match(r"\s*(\d+)\s+(\S+)\s+\[(.)\]\s+(.+)$", line)
        if found:
            count, _, kind, name = found.groups()
            name = KERNEL.sub(r"\2, \1", name.strip())
            counts[f"{SYSTEM}: {name}" if kind == "k" else name] += int(count)
    return counts


def crate(name):
    if name.startswith(SYSTEM):
        return SYSTEM
    found = re.search(r"\b(s3d_(?!simd)\w+|libm|obvhs|rayon\w*|exr|image|fdeflate|spade|parquet)\b", name)
    return found.group(1) if found else "others"


def main():
    arguments = sys.argv[1:]
    most = 40
    if arguments[:1] == ["--most"]:
        most, arguments = int(arguments[1]), arguments[2:]
    if not arguments:
        raise SystemExit(__doc__)
    counts = samples(build(), arguments)
    total = sum(counts.values())

    by_crate = collections.Counter()
    for name, count in counts.items():
        by_crate[crate(name)] += count
    print("share  crate")
    for name, count in by_crate.most_common():
        print(f"{100 * count / total:4.1f} %  {name}")
    print("\nshare  function")
    for name, count in counts.most_common(most):
        print(f"{100 * count / total:4.1f} %  {name[:120]}")


if __name__ == "__main__":
    main()
