#!/usr/bin/env python3
"""Do two states of the project make the same bytes?

    python3 s3d-cli/tests/reliability/same_bytes.py OLD_S3D NEW_S3D [--scene SCENE.toml]… [--threads N]
    python3 s3d-cli/tests/reliability/same_bytes.py OUT_A OUT_B

The first form runs both binaries: the demo, and each scene at full size, into a temporary folder. The second compares two
existing data sets. Files are compared byte for byte, except for the version of s3d: it is ignored in manifest.json. In
files.csv, the manifest's size and the lines of files with a version are ignored. Exit code 0 if all is the same, else 1.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

VERSION = re.compile(rb'("version": ?)"[^"]*"')


def files(root):
    found = {}
    for folder, _, names in os.walk(root):
        for name in names:
            path = os.path.join(folder, name)
            found[os.path.relpath(path, root)] = path
    return found


def content(name, path):
    with open(path, "rb") as file:
        data = file.read()
    if name == "manifest.json":
        data = VERSION.sub(rb'\1"-"', data)
        # Its checksums belong to files that are compared here themselves.
        told = json.loads(data)
        told.pop("files", None)
        return json.dumps(told).encode()
    if name.endswith((".json", ".toml")):
        return VERSION.sub(rb'\1"-"', data)
    return data


def compare(a, b):
    left, right = files(a), files(b)
    faults = [f"only in {a}: {name}" for name in sorted(left.keys() - right.keys())]
    faults += [f"only in {b}: {name}" for name in sorted(right.keys() - left.keys())]
    both = sorted(left.keys() & right.keys())
    faults += [f"differs: {name}" for name in both if content(name, left[name]) != content(name, right[name])]
    for fault in faults[:40]:
        print(f"  {fault}")
    print(f"{len(both)} files compared, {len(faults)} differ: {a} and {b}")
    return not faults


def run(command):
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a")
    parser.add_argument("b")
    parser.add_argument("--scene", action="append", default=[])
    parser.add_argument("--threads", default="2")
    args = parser.parse_args()
    if os.path.isdir(args.a):
        sys.exit(0 if compare(args.a, args.b) else 1)
    same = True
    with tempfile.TemporaryDirectory() as folder:
        jobs = [("demo", ["demo"])] + [(f"scene_{i}", ["export", s]) for i, s in enumerate(args.scene)]
        for name, words in jobs:
            outs = [os.path.join(folder, name + side) for side in ("_a", "_b")]
            for program, out in zip((args.a, args.b), outs):
                run([program, "--quiet", *words, "-o", out, "--threads", args.threads])
            same &= compare(*outs)
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
