#!/usr/bin/env python3
"""How time and memory of `s3d export` grow with a scan: makes scans of growing size with the example `large_scene`,
exports each, and writes `large.csv` beside itself and the picture docs/reliability/large.svg.

    cargo build --release -p s3d-cli -p s3d-synth --bin s3d --example large_scene
    s3d-cli/tests/reliability/curves.py --work /somewhere/with/25/GB [--only points,tree,faces,materials,locations,labels] [--most N]

It measures the process's wall clock, its user and system time and its peak memory (getrusage of the child), and the times
of the stages that the process logs. Images are few and small, so that the growing quantity decides. `--most` leaves out
larger scans. Rows of other curves in `large.csv` are kept, so that curves can be measured one at a time.
"""

import argparse
import csv
import math
import os
import pathlib
import re
import shutil
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
FEW_IMAGES = ["--views", "1", "--size", "64", "--modalities", "pose", "--points-per-m2", "10"]

# Name: the growing quantity, its sizes, further arguments of the scene, further arguments of the export.
CURVES = {
    "points": ("points of one PLY cloud", [470_000, 4_700_000, 47_000_000, 470_000_000],
               ["--labels", "1000", "--faces", "1000000", "--cameras", "1"], FEW_IMAGES),
    "tree": ("points of an S3DIS tree (text)", [470_000, 4_700_000, 47_000_000],
             ["--labels", "1000", "--faces", "1000000", "--cameras", "1", "--form", "s3dis"], FEW_IMAGES),
    "faces": ("faces", [10_000, 100_000, 1_000_000, 10_000_000],
              ["--labels", "500", "--points", "1000000", "--cameras", "1"],
              ["--views", "72", "--modalities", "depth", "--points-per-m2", "10", "--compression", "fast"]),
    "materials": ("materials, each with a texture of 256 × 256", [2, 20, 200, 2000],
                  ["--labels", "500", "--faces", "100000", "--points", "100000", "--cameras", "1", "--texture", "256"],
                  ["--views", "4", "--size", "256", "--pano-width", "1024", "--modalities", "rgb", "--points-per-m2", "10",
                   "--compression", "fast"]),
    "locations": ("scan locations with 72 candidate views of 128 × 128", [3, 30, 300, 3000],
                  ["--labels", "500", "--faces", "100000", "--points", "1000000"],
                  ["--views", "72", "--size", "128", "--modalities", "pose", "--points-per-m2", "10"]),
    "labels": ("labels", [50, 500, 5000, 50_000],
               ["--faces", "1000000", "--points", "5000000", "--cameras", "1"], FEW_IMAGES),
}
OPTION = {"tree": "--points", "locations": "--cameras"}
COLUMNS = ["curve", "size", "wall_s", "user_s", "sys_s", "peak_mb", "label_s", "score_s", "render_s", "output_mb"]


def run(command, log):
    """Runs the command. Returns its wall clock, and the system's report about it."""
    started = time.monotonic()
    with open(log, "wb") as out:
        pid = os.posix_spawnp(command[0], command, os.environ, file_actions=[
            (os.POSIX_SPAWN_DUP2, out.fileno(), 1), (os.POSIX_SPAWN_DUP2, out.fileno(), 2)])
        _, status, usage = os.wait4(pid, 0)
    if status:
        sys.exit(f"{' '.join(command)} failed:\n" + pathlib.Path(log).read_text(errors="replace")[-3000:])
    return time.monotonic() - started, usage


def stage(log, pattern):
    found = re.findall(pattern + r".*\(([0-9.]+) s\)", log)
    return float(found[-1]) if found else ""


def measure(args, curve, size):
    what, _, scene, export = CURVES[curve]
    work = pathlib.Path(args.work) / f"{curve}_{size}"
    shutil.rmtree(work, ignore_errors=True)
    scan, out, log = work / "scan", work / "out", work / "log"
    work.mkdir(parents=True)
    run([args.generator, str(scan), OPTION.get(curve, f"--{curve}"), str(size), *scene], work / "scene_log")
    environment = {"TMPDIR": str(work)}
    os.environ.update(environment)
    wall, usage = run([args.s3d, "export", str(scan / "scene.toml"), "-o", str(out), "-v", *export], log)
    text = log.read_text(errors="replace")
    row = {
        "curve": curve, "size": size, "wall_s": round(wall, 1), "user_s": round(usage.ru_utime, 1),
        "sys_s": round(usage.ru_stime, 1), "peak_mb": round(usage.ru_maxrss / 1024),
        "label_s": stage(text, "annotated points labelled"), "score_s": stage(text, "candidates scored"),
        "render_s": stage(text, "panoramas and .* views rendered"),
        "output_mb": round(sum(f.stat().st_size for f in out.rglob("*") if f.is_file()) / 1e6),
    }
    shutil.rmtree(work)
    print(f"{what}: {row}", flush=True)
    return row


def draw(rows, path):
    """Draws two plots a curve in a row: seconds of the processors, and peak memory. Both axes are
    logarithmic.
    """
    width, height, left, top = 330, 190, 62, 46
    plots = []
    for i, (curve, (what, *_)) in enumerate(CURVES.items()):
        points = sorted((int(r["size"]), float(r["user_s"]) + float(r["sys_s"]), float(r["peak_mb"]))
                        for r in rows if r["curve"] == curve)
        for j, unit in enumerate(["processor seconds", "peak memory, MB"]):
            data = [(p[0], max(p[1 + j], 0.01)) for p in points]
            if data:
                plots.append(plot(left + j * (width + 80), top + i * (height + 78), width, height, what, unit, data))
    total = (2 * (width + 80) + 20, len(CURVES) * (height + 78) + 20)
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total[0]} {total[1]}" font-family="sans-serif" '
        f'font-size="12">\n<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(plots) + "\n</svg>\n")


def plot(x0, y0, width, height, what, unit, data):
    decades = [(math.floor(math.log10(min(v))), math.ceil(math.log10(max(v)) + 1e-9)) for v in zip(*data)]
    (xa, xb), (ya, yb) = [(a, max(b, a + 1)) for a, b in decades]
    at = lambda x, y: (x0 + width * (math.log10(x) - xa) / (xb - xa), y0 + height * (yb - math.log10(y)) / (yb - ya))
    lines = [f'<text x="{x0}" y="{y0 - 12}" font-weight="bold">{what}</text>',
             f'<text x="{x0 + width}" y="{y0 + height + 34}" text-anchor="end" fill="#555">{unit}</text>']
    for e in range(xa, xb + 1):
        x = at(10.0 ** e, 1)[0]
        lines.append(f'<path d="M{x:.1f} {y0}V{y0 + height}" stroke="#ddd"/>'
                     f'<text x="{x:.1f}" y="{y0 + height + 16}" text-anchor="middle">{tens(e)}</text>')
    for e in range(ya, yb + 1):
        y = at(1, 10.0 ** e)[1]
        lines.append(f'<path d="M{x0} {y:.1f}H{x0 + width}" stroke="#ddd"/>'
                     f'<text x="{x0 - 6}" y="{y + 4:.1f}" text-anchor="end">{tens(e)}</text>')
    places = [at(x, y) for x, y in data]
    lines.append('<polyline fill="none" stroke="#2563a8" stroke-width="2" points="'
                 + " ".join(f"{x:.1f},{y:.1f}" for x, y in places) + '"/>')
    for (x, y), (_, value) in zip(places, data):
        lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#2563a8"/>'
                     f'<text x="{x:.1f}" y="{y - 7:.1f}" text-anchor="middle" font-size="10">{value:.3g}</text>'
                     if value < 1000 else
                     f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#2563a8"/>'
                     f'<text x="{x:.1f}" y="{y - 7:.1f}" text-anchor="middle" font-size="10">{value:.0f}</text>')
    return "\n".join(lines)


def table_of(rows):
    """Prints the rows as Markdown."""
    lines = ["| what grows | size | processor s | of which system | wall clock s | peak MB | data set MB |",
             "|---|---:|---:|---:|---:|---:|---:|"]
    for r in rows:
        user, system = float(r["user_s"]), float(r["sys_s"])
        lines.append(f"| {CURVES[r['curve']][0]} | {int(r['size']):,} | {user + system:.1f} | {system:.1f} | "
                     f"{float(r['wall_s']):.0f} | {int(r['peak_mb']):,} | {int(r['output_mb']):,} |")
    return "\n".join(lines)


def tens(exponent):
    return {-2: "0.01", -1: "0.1", 0: "1", 1: "10", 2: "100", 3: "1,000", 4: "10,000", 5: "100,000", 6: "1 million",
            7: "10 million", 8: "100 million", 9: "1 billion"}[exponent]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", required=True, help="folder for scans and data sets, removed after use")
    parser.add_argument("--s3d", default=str(ROOT / "target/release/s3d"))
    parser.add_argument("--generator", default=str(ROOT / "target/release/examples/large_scene"))
    parser.add_argument("--only", default=",".join(CURVES), help="curves to measure")
    parser.add_argument("--most", type=int, default=10**12, help="largest size to measure")
    parser.add_argument("--draw", action="store_true", help="draw what is measured already and print it as a table, and measure nothing")
    args = parser.parse_args()
    table = HERE / "large.csv"
    rows = list(csv.DictReader(table.open())) if table.exists() else []
    for curve in [] if args.draw else args.only.split(","):
        for size in CURVES[curve][1]:
            if size <= args.most:
                row = measure(args, curve, size)
                rows = [r for r in rows if (r["curve"], int(r["size"])) != (curve, size)] + [row]
                rows.sort(key=lambda r: (list(CURVES).index(r["curve"]), int(r["size"])))
                with table.open("w", newline="") as f:
                    writer = csv.DictWriter(f, COLUMNS, lineterminator="\n")
                    writer.writeheader()
                    writer.writerows(rows)
    draw(rows, ROOT / "docs/reliability/large.svg")
    print(table_of(rows))


if __name__ == "__main__":
    main()
