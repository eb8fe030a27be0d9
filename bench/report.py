"""What a report costs beside the export of the same data set.

    python3 bench/report.py S3D… [--scene SCENE.toml] [--rounds N] [--threads N] [--scratch DIR]

Each binary exports the scene, or the built-in one at full size, and makes the report of it, in turns. Printed are medians
of seconds, of processor seconds (user and system), and the median of the rounds' ratios report / export of both.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path


def seconds(command):
    """Of the clock and of processors."""
    begin = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    message = child.stderr.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{message}")
    return time.perf_counter() - begin, usage.ru_utime + usage.ru_stime


def turn(s3d, scene, threads, scratch):
    out, page = scratch / "out", scratch / "page"
    options = ["--quiet", "--threads", str(threads)]
    # What an earlier turn wrote must not be written back in this one's time.
    os.sync()
    exported = seconds([s3d, "export", str(scene), "-o", str(out), *options])
    os.sync()
    reported = seconds([s3d, "report", str(out), "-o", str(page), *options])
    size = sum(file.stat().st_size for file in page.rglob("*") if file.is_file())
    shutil.rmtree(out)
    shutil.rmtree(page)
    return exported, reported, size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("s3d", nargs="+")
    parser.add_argument("--scene")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--scratch", type=Path)
    args = parser.parse_args()
    rounds = {s3d: [] for s3d in args.s3d}
    with tempfile.TemporaryDirectory(dir=args.scratch) as scratch:
        scratch, scene = Path(scratch), args.scene
        if not scene:
            seconds([args.s3d[0], "demo", "-o", str(scratch / "demo"), "--no-images", "--quiet"])
            scene = scratch / "demo" / "scan" / "scene.toml"
        for _ in range(args.rounds):
            for s3d in args.s3d:
                rounds[s3d].append(turn(s3d, scene, args.threads, scratch))
    for s3d, turns in rounds.items():
        for kind, what in enumerate(["seconds", "processor seconds"]):
            export, report = (statistics.median(turn[i][kind] for turn in turns) for i in (0, 1))
            ratio = statistics.median(turn[1][kind] / turn[0][kind] for turn in turns)
            print(f"{s3d} {what}: export {export:.2f}, report {report:.2f}, ratio {ratio:.3f}")
        print(f"{s3d} report: {turns[-1][2] / 1e6:.1f} MB", flush=True)


if __name__ == "__main__":
    main()
