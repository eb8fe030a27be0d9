"""How well s3d and Open3D fuse raw scans of scenes whose surface is known.

    cargo build --release -p s3d-cli -p s3d-synth --examples
    python3 bench/fusion/scenes.py -o OUT [--copyroom DIR/rgb.obj]

Needs Linux, numpy and open3d (0.19.0, whose two grids both make meshes). Each scene is scanned by each
device of the example `raw_scan` of s3d-synth. `s3d fuse`, and each method of `peers.py`, makes a mesh of the
scan with the same cell, range and threads, and `raw_scan --score` compares it with the scene. OUT keeps the
scans, the meshes, and a line of JSON for each in `results.jsonl`. What it holds already is not done again. At
the end it prints tables.

| scene | what it is | locations |
|---|---|---|
| `office` | the office of the built-in scene | 1 |
| `demo` | the built-in scene: its office and its conference room | 3 |
| `two-storeys` | a house of two storeys | 4 |
| `copyroom` | the mesh of a real scan, scanned again | 3 |

| device | |
|---|---|
| `tum` | a depth camera in a hand, 60 pictures a location |
| `ptx` | a laser scanner on a tripod |
"""

import argparse
import json
import os
import sys
from pathlib import Path

from peers import METHODS, measured

SCENES = {"office": 1, "demo": 3, "two-storeys": 4, "copyroom": 3}
DEVICES = ["tum", "ptx"]

# Corners with no more observations are left out of VoxelBlockGrid's mesh. One laser scan is all that most
# places have.
WEIGHT = {"tum": 3, "ptx": 0.5}
RANGE_M = {"tum": 5, "ptx": 60}

SHORT = {
    "F, 1 cm": ("10 mm", "f_score"),
    "precision": ("10 mm", "precision"),
    "recall": ("10 mm", "recall"),
    "F, 2 cm": ("20 mm", "f_score"),
    "accuracy, mm": ("accuracy_mean_mm",),
    "completeness, mm": ("completeness_mean_mm",),
    "normals": ("normal_consistency",),
    "closed": ("closed_sight",),
    "doors": ("doors",),
    "legs": ("legs",),
}


def jobs(args):
    """The command of each mesh: scene, device, method, words."""
    for scene in args.scenes:
        for device in args.devices:
            folder = args.out / f"{scene}-{device}" / "freiburg1"
            name = args.copyroom if scene == "copyroom" else scene
            scan = [str(args.raw_scan), device, str(folder), "--scene", str(name)]
            scan += ["--locations", str(SCENES[scene])]
            for method in args.methods:
                yield scene, device, method, folder, scan


def fuse(args, folder, device, mesh):
    words = [str(args.s3d), "fuse", str(folder / "scan.ptx" if device == "ptx" else folder), "-o", str(mesh)]
    words += ["--cell", str(args.cell), "--range", str(RANGE_M[device]), "--threads", str(args.threads)]
    words += ["--overwrite", "--quiet", *args.s3d_options.split()]
    return measured(words, args.threads, prints_json=False)[1]


def peer(args, folder, device, mesh, method):
    words = [args.python, str(Path(__file__).with_name("peers.py")), str(folder), "-o", str(mesh.parent)]
    words += ["--one", method, "--cell", str(args.cell), "--range", str(RANGE_M[device])]
    words += ["--weight", str(WEIGHT[device]), "--threads", str(args.threads)]
    said, taken = measured(words, args.threads)
    return {**said, **taken}


def run(args, results, done):
    for scene, device, method, folder, scan in jobs(args):
        if (scene, device, method) in done:
            continue
        if not folder.exists():
            measured(scan, args.threads, prints_json=False)
        mesh = folder.parent / f"{method}.ply"
        is_ours = method.startswith("s3d")
        told = {"scene": scene, "device": device, "method": method}
        told |= fuse(args, folder, device, mesh) if is_ours else peer(args, folder, device, mesh, method)
        if told.get("faces") != 0:
            told["scores"] = measured([*scan, "--score", str(mesh)], args.threads)[0]
        results.write(json.dumps(told) + "\n")
        results.flush()
        print(json.dumps(told), flush=True)


def table(rows):
    """The rows of a scene and a device as Markdown."""
    lines = [f"| | {' | '.join(SHORT)} | s | MB |", "|---" * (len(SHORT) + 3) + "|"]
    for row in rows:
        cells = []
        for keys in SHORT.values():
            value = row.get("scores")
            for key in keys:
                value = value and value[key]
            digits = 1 if keys[-1].endswith("_mm") else 3
            cells.append("–" if value is None else f"{value:.{digits}f}")
        cells += [f"{row['processor_seconds']:.0f}", str(row["peak_mb"])]
        lines.append(f"| {row['method']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main():
    text = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=text)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--s3d", type=Path, default=Path("target/release/s3d"))
    parser.add_argument("--raw-scan", type=Path, default=Path("target/release/examples/raw_scan"))
    parser.add_argument("--python", default=sys.executable, help="a Python that has open3d")
    parser.add_argument("--copyroom", type=Path, help="the mesh of a scan, Y-up, with its cameras.csv beside it")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--devices", nargs="+", choices=DEVICES, default=DEVICES)
    parser.add_argument("--methods", nargs="+", default=["s3d", "scalable", "blocks", "poisson10"],
                        help=f"s3d, a name that begins so, or of {', '.join(METHODS)}")
    parser.add_argument("--s3d-options", default="", help="more words for s3d fuse")
    parser.add_argument("--cell", type=float, default=0.01)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    if args.copyroom is None:
        args.scenes = [scene for scene in args.scenes if scene != "copyroom"]

    args.out.mkdir(parents=True, exist_ok=True)
    file = args.out / "results.jsonl"
    kept = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    with file.open("a") as results:
        run(args, results, {(r["scene"], r["device"], r["method"]) for r in kept})

    rows = [json.loads(line) for line in file.read_text().splitlines()]
    for scene in SCENES:
        for device in DEVICES:
            some = [row for row in rows if (row["scene"], row["device"]) == (scene, device)]
            if some:
                print(f"\n**{scene}, {device}**\n\n{table(some)}")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "2")
    main()
