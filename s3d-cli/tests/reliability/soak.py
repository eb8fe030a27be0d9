#!/usr/bin/env python3
"""Exports of the built-in scene with random options, each checked.

    python3 s3d-cli/tests/reliability/soak.py S3D [--runs N] [--seed SEED] [--check CHECKER [--python PYTHON]]

Each run draws options from SEED and its number, exports with 1 and with 2 threads, compares the two byte for byte, and
verifies one. CHECKER is your own program: it takes the folder of a data set, and exits with 0 if it finds nothing. It runs
on exports with views, the published forms and every modality. Prints a line a run; exit code 1 if one failed.
"""

import argparse
import filecmp
import os
import random
import subprocess
import sys
import tempfile
import time

MODALITIES = ["rgb", "depth", "normal", "semantic", "semantic_pretty", "global_xyz", "pose"]


def draw(rng):
    """Returns options of an export, whether it has views, and whether it has the published forms."""
    options = ["--seed", rng.randrange(2**64), "--size", rng.randrange(8, 120), "--pano-width", 2 * rng.randrange(4, 120)]
    views = rng.randrange(0, 7)
    options += ["--views", views, "--points-per-m2", rng.choice([0.5, 5, 60])]
    options += ["--pool", rng.choice(["dataset", "area", "location"]), "--entropy-stride", rng.choice([1, 2, 4, 64])]
    options += ["--compression", rng.choice(["fast", "balanced", "small"])]
    for flag in ["--keep-all", "--smooth-normals", "--lenient"]:
        options += [flag] * rng.choice([0, 0, 1])
    if rng.random() < 0.3:
        options += ["--place-cameras", rng.choice([1.5, 3, 8])]
    for profile in ["pointcept", "open3d-ml", "mmdet3d", "pointnet"]:
        options += ["--profile", profile] * rng.choice([0, 0, 0, 1])
    is_published = rng.random() < 0.5
    if not is_published:
        options += ["--xyz", rng.choice(["half", "float", "none"]), "--normal-axes", rng.choice(["paper", "opencv"])]
        options += ["--depth-units", rng.choice(["512", "mm"]), "--pad-labels", rng.choice(["off", 3342, 500])]
        options += ["--modalities", ",".join(rng.sample(MODALITIES, rng.randrange(1, 8)))]
    return [str(option) for option in options], is_published and views > 0


def files(root):
    return {os.path.relpath(os.path.join(at, name), root) for at, _, names in os.walk(root) for name in names}


def faults(s3d, scene, folder, options, checker):
    outs = [os.path.join(folder, f"out_{threads}") for threads in (1, 2)]
    for threads, out in zip("12", outs):
        done = subprocess.run([s3d, "export", scene, "-o", out, "--quiet", "--threads", threads, *options], stderr=subprocess.PIPE)
        if done.returncode:
            yield f"export: {done.stderr.decode()}"
            return
    names = files(outs[0])
    if names != files(outs[1]):
        yield "other files with another number of threads"
    yield from (f"{name} differs with another number of threads" for name in filecmp.cmpfiles(*outs, names, shallow=False)[1])
    for command in [[s3d, "verify", outs[0]], *([[*checker, outs[0]]] if checker else [])]:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if done.returncode:
            yield f"{command[0]}: {done.stdout.decode()}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("s3d")
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--check")
    parser.add_argument("--python", default=sys.executable)
    args = parser.parse_args()
    checker = [args.python, args.check] if args.check else None
    failed = checked = 0
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as scratch:
        demo = os.path.join(scratch, "demo")
        small = ["--views", "0", "--size", "8", "--pano-width", "8", "--points-per-m2", "1"]
        subprocess.run([args.s3d, "demo", "-o", demo, "--quiet", *small], check=True)
        for number in range(args.runs):
            options, is_published = draw(random.Random(f"{args.seed} {number}"))
            with tempfile.TemporaryDirectory(dir=scratch) as folder:
                check = checker if is_published else None
                found = list(faults(args.s3d, os.path.join(demo, "scan", "scene.toml"), folder, options, check))
            failed += bool(found)
            checked += check is not None
            print(number, "FAILED" if found else "ok", " ".join(options), *found, flush=True)
    print(f"{args.runs} runs, {checked} checked by another program, {failed} failed, {time.monotonic() - started:.0f} s")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
