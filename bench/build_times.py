#!/usr/bin/env python3
"""How long the crates take to build from nothing, each alone: the processor time of all that it depends on.

    python3 bench/build_times.py [TREE]

TREE is a checkout of this repository. Its release build is made once, in an empty folder, with this program as
RUSTC_WRAPPER: it notes the processor time of each call of the compiler. The time of a crate is the sum over the packages
that `cargo tree` names for it; for a feature of s3d-io it is that of the packages beside s3d-io itself, whose own time
was taken with all features. Processor time hardly depends on what else
the machine does; with N cores a build takes an Nth of it at best.
"""

import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

LOG = "S3D_BUILD_TIMES"


def note(command):
    """As a wrapper: runs the compiler and notes what it took."""
    code = subprocess.call(command, close_fds=False)  # cargo hands on open files
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    package = f"{os.environ.get('CARGO_PKG_NAME')} v{os.environ.get('CARGO_PKG_VERSION')}"
    with open(os.environ[LOG], "a") as log:
        log.write(f"{package}\t{used.ru_utime + used.ru_stime}\n")
    sys.exit(code)


def build(tree):
    """The processor time of each package of a release build."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log")
        log.touch()
        wrapper = {"RUSTC_WRAPPER": os.path.abspath(__file__), LOG: str(log), "CARGO_TARGET_DIR": folder + "/target"}
        subprocess.run(["cargo", "build", "--release", "--workspace", "--quiet"], cwd=tree, check=True,
                       env=os.environ | wrapper)
        times = Counter()
        for line in log.read_text().splitlines():
            package, seconds = line.split("\t")
            times[package] += float(seconds)
        return times


def packages(tree, crate, *options):
    """What is built for a crate, itself included, as cargo calls it."""
    command = ["cargo", "tree", "-p", crate, "-e", "normal,build", "--prefix", "none", *options]
    found = subprocess.run(command, cwd=tree, check=True, capture_output=True, text=True).stdout
    return set(re.findall(r"^\S+ v\S+", found, re.M))


def main():
    tree = sys.argv[1] if len(sys.argv) > 1 else "."
    times = build(tree)
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    metadata = json.loads(subprocess.run(command, cwd=tree, check=True, capture_output=True).stdout)
    crates = {package["name"]: package for package in metadata["packages"]}
    rows = [(name, packages(tree, name)) for name in sorted(crates)]
    features = sorted(set(crates["s3d-io"]["features"]) - {"default"})
    if features:
        rows.append(("s3d-io, no feature", packages(tree, "s3d-io", "--no-default-features")))
    for feature in features:
        options = ["--no-default-features", "--features", feature]
        rows.append((f"s3d-io, {feature}", packages(tree, "s3d-io", *options)))
    print("| crate | packages | CPU s | of it itself |\n|---|---:|---:|---:|")
    for name, parts in rows:
        own = sum(times[part] for part in parts if part.startswith(name.split(",")[0] + " "))
        all_of_it = sum(times[part] for part in parts)
        if "," in name:
            print(f"| {name} | {len(parts)} | {all_of_it - own:.0f} | |")
        else:
            print(f"| {name} | {len(parts)} | {all_of_it:.0f} | {own:.0f} |")


if __name__ == "__main__":
    if LOG in os.environ and len(sys.argv) > 1:
        note(sys.argv[1:])
    main()
