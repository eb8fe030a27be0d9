"""Whole commands of two states of the project against each other.

    python3 bench/whole_commands.py OLD_S3D NEW_S3D SCENE.toml… [--rounds N] [--scratch DIR]

Both binaries take turns on each scene, with one thread. Printed are medians of user seconds, and the median of the
ratios new / old of the rounds. `reading` samples a single point of the exported mesh. What begins with `=` is the
difference of two commands: sampling without reading, an export without reading or without what is no image.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

# What every export has, and the ten cues of Omnidata's annotator.
USUAL = "rgb,depth,normal,semantic,semantic_pretty,global_xyz,pose"
CUES = "depth_euclidean,reshading,principal_curvature,edge_occlusion,edge_texture,keypoints2d,keypoints3d"
CUES += ",segment_unsup2d,segment_unsup25d,mask_valid"

EXPORTS = {
    "without images": ["--views", "0", "--modalities", "pose"],
    "with panoramas": ["--views", "0"],
    "export": [],
    "with cues": ["--modalities", f"{USUAL},{CUES}"],
}


def user_seconds(command):
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    message = child.stderr.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{message}")
    return usage.ru_utime


def turn(s3d, scene, scratch):
    times = {}
    for name, options in EXPORTS.items():
        out = scratch / "out"
        times[name] = user_seconds([s3d, "export", scene, "-o", str(out), "--quiet", "--threads", "1", *options])
        if name == "without images":
            mesh, cloud = next(out.glob("area_*/3d/rgb.obj")), scratch / "cloud.ply"
            for name, points in (("reading", 1), ("sample", 4_000_000)):
                options = ["-o", str(cloud), "--points", str(points), "--overwrite", "--threads", "1", "--quiet"]
                times[name] = user_seconds([s3d, "sample", str(mesh), *options])
        shutil.rmtree(out)
    times["= sampling"] = times["sample"] - times["reading"]
    times["= labels and points"] = times["without images"] - times["reading"]
    times["= panoramas"] = times["with panoramas"] - times["without images"]
    times["= images"] = times["export"] - times["without images"]
    times["= cues"] = times["with cues"] - times["export"]
    return times


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--scratch", type=Path)
    args = parser.parse_args()
    if args.scratch:
        args.scratch.mkdir(parents=True, exist_ok=True)
    for scene in args.scenes:
        with tempfile.TemporaryDirectory(dir=args.scratch) as scratch:
            scratch = Path(scratch)
            rounds = []
            for number in range(args.rounds + 1):
                states = [args.old, args.new][:: 1 if number % 2 else -1]
                times = {s3d: turn(s3d, scene, scratch) for s3d in states}
                if number:
                    rounds.append((times[args.old], times[args.new]))
        for name in rounds[0][0]:
            old, new = (statistics.median(turn[name] for turn in turns) for turns in zip(*rounds))
            ratio = statistics.median(after[name] / before[name] for before, after in rounds)
            print(f"{scene} {name}: {old:.2f} s, {new:.2f} s, {ratio:.3f}", flush=True)


if __name__ == "__main__":
    main()
