"""The visibility pass against Embree: speed and exactness, on three scenes, in one run.

    cargo build --release -p s3d-render --example visibility
    python3 bench/visibility_peers.py OFFICE/scene.obj COPYROOM/rgb.obj [--rounds N] [--scratch DIR] [--only SCENE] [--isa ISA --visibility PROGRAM]

Needs Linux, g++, Embree 3 (Debian: libembree-dev) and numpy. OFFICE is a folder written by gen_scene.py of the peers
(Z up), COPYROOM the scan of the copy room (Y up); the third scene is generated. The dumps take 0.8 GB a scene.

Speed: rounds of one program and the other take turns, because other work on a machine disturbs both alike only then.
Both run on one thread and count their own user time. The ratio is taken round by round; its median and range are printed.
Both use the widest registers of the processor. `--isa avx2` holds Embree to AVX2; compare that only with a build of the
example that is held to it as well (`--visibility`), else the ratio flatters ours about twofold.

Exactness: every pixel against Embree's robust mode. Where they name faces at different distances (1e-5), the exact ray
decides: in rational numbers, over all faces, from the f64 direction that s3d casts. The same is done for the direction
rounded to f32 that Embree is given, which says whether rounding the ray or Embree's arithmetic made the difference.
"""

import argparse
import csv
import re
import subprocess
import tempfile
from fractions import Fraction
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
VISIBILITY = HERE.parent / "target" / "release" / "examples" / "visibility"
NO_FACE = -1


def rates(command):
    """Mray/s of user time: of the views, and of the panorama."""
    out = subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout
    return [float(re.search(rf"^{what}: ([0-9.]+) Mray/s a core", out, re.M)[1]) for what in ("views", "panorama")]


class Dump:
    """What `visibility --dump` wrote: the mesh relative to the origin, and the rays."""

    def __init__(self, folder):
        words = (folder / "dump.txt").read_text().split()
        self.origin = np.array([float(w) for w in words[7:10]])
        positions = np.fromfile(folder / "positions.f32", "<f4").reshape(-1, 3)
        faces = np.fromfile(folder / "faces.u32", "<u4").reshape(-1, 3)
        # Differences of f32 are all but exact in f64, and rational numbers below make no use of them.
        self.corners = positions.astype(float)[faces] - self.origin
        self.exact = lambda face: [[Fraction(float(x)) - Fraction(float(o)) for x, o in zip(p, self.origin)]
                                   for p in positions[faces[face]]]
        self.views = np.fromfile(folder / "views.f64", "<f8").reshape(-1, 3, 3)
        self.columns = np.fromfile(folder / "columns.f64", "<f8").reshape(-1, 2)
        self.rows = np.fromfile(folder / "rows.f64", "<f8").reshape(-1, 2)
        a, b, c = (self.corners[:, k] for k in range(3))
        self.planes = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)
        self.turn = np.einsum("ij,ij->i", a, self.planes[:, 0])

    def direction(self, image, i, j):
        if image == "pano":
            (cc, cs), (rc, rs) = self.columns[i], self.rows[j]
            return np.array([rc * cc, rc * cs, rs])
        corner, x_step, y_step = self.views[int(image.removeprefix("view_"))]
        return corner + x_step * (i + 0.5) + y_step * (j + 0.5)

    def pixels(self, image):
        """Pixels a radian in the middle of the image."""
        return len(self.columns) / (2 * np.pi) if image == "pano" else 1 / np.linalg.norm(self.views[0][1])

    def see(self, d):
        """The first face that the ray along `d` hits, and how far away: exactly."""
        sides = self.planes @ d * np.sign(self.turn)[:, None]
        slack = 1e-9 * np.linalg.norm(self.planes, axis=2) * np.linalg.norm(d)
        exact_d, nearest = [Fraction(float(x)) for x in d], (None, NO_FACE)
        for face in np.flatnonzero((sides >= -slack).all(1)):
            a, b, c = self.exact(face)
            inside = [dot(exact_d, cross(p, q)) for p, q in ((b, c), (c, a), (a, b))]
            volume = dot(a, cross(b, c))
            if volume == 0 or any(s * volume < 0 for s in inside) or sum(inside) == 0:
                continue
            t = volume / sum(inside)
            if t > 0 and (nearest[0] is None or t < nearest[0]):
                nearest = (t, int(face))
        return nearest[1], float("inf") if nearest[0] is None else float(nearest[0])

    def edge_distance(self, d, faces):
        """How far the ray is from the nearest edge of some faces, in radians."""
        planes = np.concatenate([self.planes[f] for f in faces if f != NO_FACE])
        return float(np.min(np.abs(planes @ d) / np.linalg.norm(planes, axis=1)) / np.linalg.norm(d))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def same(t, s):
    return t == s or np.isfinite(t) and abs(t - s) <= 1e-5 * abs(t)


def judge(folder):
    """Decides each pixel where the two differ; returns how often each explanation holds."""
    dump, count = Dump(folder), {"ours is right": 0, "OURS IS WRONG": 0, "rounded ray": 0, "Embree's arithmetic": 0}
    for row in csv.DictReader(open(folder / "differences.csv")):
        image, i, j = row["image"], int(row["column"]), int(row["row"])
        ours, theirs = (int(row["face"]), float(row["depth"])), (int(row["embree_face"]), float(row["embree_depth"]))
        d = dump.direction(image, i, j)
        face, t = dump.see(d)
        rounded = dump.see(d.astype(np.float32).astype(float))
        right = ours[0] == face and (ours[1] == t or abs(ours[1] - t) <= 1e-6 * t)
        cause = "rounded ray" if same(rounded[1], theirs[1]) else "Embree's arithmetic"
        count["ours is right" if right else "OURS IS WRONG"] += 1
        if right:
            count[cause] += 1
        off = dump.edge_distance(d, {ours[0], theirs[0]}) * dump.pixels(image)
        print(f"  {image} ({i}, {j}): ours {ours[0]} at {ours[1]:.6g}, Embree {theirs[0]} at {theirs[1]:.6g}; exactly "
              f"{face} at {t:.6g}: {'ours is right' if right else 'OURS IS WRONG'}; Embree's ray sees {rounded[0]} at "
              f"{rounded[1]:.6g}: {cause}; {off:.1e} px from an edge")
    return count


def spread(ratios):
    return f"{np.median(ratios):.2f} ({min(ratios):.2f}–{max(ratios):.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("office", help="scene.obj of gen_scene.py")
    parser.add_argument("copyroom", help="rgb.obj of the copy room")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--scratch", type=Path, help="where dumps and programs go; a temporary folder if not given")
    parser.add_argument("--isa", help="the most that Embree may use, such as avx2")
    parser.add_argument("--visibility", type=Path, default=VISIBILITY, help="another build of the example")
    parser.add_argument("--only", choices=["office", "copyroom", "scan-like", "dense"],
                        help="dense, ten million faces, is left out otherwise: it takes 12 GB of memory")
    args = parser.parse_args()
    temporary = None if args.scratch else tempfile.TemporaryDirectory()
    scratch = args.scratch or Path(temporary.name)
    scratch.mkdir(parents=True, exist_ok=True)
    embree = scratch / "embree_cast"
    subprocess.run(["g++", "-O3", "-march=native", "-ffp-contract=off", "-o", embree, HERE / "embree_cast.cpp", "-lembree3"],
                   check=True)
    scenes = {
        "office": [args.office, "4.03", "3.07", "1.5", "--up", "z"],
        "copyroom": [args.copyroom, "13.1", "9.65", "1.4"],
        "scan-like": ["scan-like:300000", "3", "2.5", "1.5"],
        "dense": ["scan-like:10000000", "3", "2.5", "1.5"],
    }
    lines = []
    for name, scene in scenes.items():
        if name != (args.only or name) or (name == "dense" and not args.only):
            continue
        folder = scratch / name
        rates([args.visibility, *scene, "--rounds", "1", "--dump", folder])
        agreement = subprocess.run([str(embree), "compare", str(folder)], check=True, capture_output=True, text=True).stdout
        print(f"{name}:\n{agreement}", end="", flush=True)
        verdict = judge(folder)
        agreed = [re.search(rf"^{what}: .* ([0-9.]+) % equal", agreement, re.M)[1] for what in ("views", "panorama")]
        rounds = []
        for _ in range(args.rounds):
            peer = rates([embree, "time", folder, "1", *([args.isa] if args.isa else [])])
            ours = rates([args.visibility, *scene, "--rounds", "1"])
            rounds.append((peer, ours))
        table = np.array(rounds)  # round × (Embree, ours) × (views, panorama)
        for k, what in enumerate(("72 views", "panorama")):
            peer, ours = table[:, 0, k], table[:, 1, k]
            lines.append(f"| {name}, {what} | {np.median(peer):.1f} | {np.median(ours):.1f} | {spread(ours / peer)} | "
                         f"{agreed[k]} % |")
        lines.append(f"| {name}, pixels that differ | " + ", ".join(f"{v} {k}" for k, v in verdict.items()) + " |||")
        print("\n".join(lines[-3:]), flush=True)
    print("\n| Mray/s a core | Embree: 8- or 16-wide, whichever is faster | ours | ratio | equal, worst image |")
    print("|---|---|---|---|---|")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
