#!/usr/bin/env python3
"""Nearest faces and coloured points a second and core, here and with Open3D, trimesh and numpy.

    python3 bench/near_sample_peers.py MESH.obj|scan_like:300000 [--up y|z] [--points 1000000] [--runs 3]

Builds and runs s3d-io's example `near_and_sample`, which writes the mesh, its points — 5 mm off the surface, either side
— and its answers to a temporary folder; then times the others on exactly these, each in a process of its own. A figure is
millions of points a second of user time, on one thread where a library allows to say so. Ratios are ours to theirs.

The answers are compared, too: how many points get another face, and how much farther it is at most. Needs numpy; open3d
and trimesh where they are to be timed.
"""
import argparse, os, resource, statistics, subprocess, sys, tempfile
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[1]
# trimesh takes seconds for what others do at once.
SLOW_SHARE = 10


def columns(folder):
    read = lambda name, kind, width: np.fromfile(folder / name, kind).reshape(-1, width)
    return read("vertices.f32", "<f4", 3), read("faces.u32", "<u4", 3)


def texture(folder):
    width, height = map(int, (folder / "texture.txt").read_text().split())
    if not width:
        return None, None
    uvs = np.fromfile(folder / "uvs.f32", "<f4").reshape(-1, 3, 2)
    return np.fromfile(folder / "texture.rgb", np.uint8).reshape(height, width, 3), uvs


def rate(points, runs, work):
    """Millions of points a second of user time, the median of some runs after one that warms up; and the last result."""
    seconds, result = [], work()
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        result = work()
        seconds.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
    return points * 1e-6 / statistics.median(seconds), result


def nearest_open3d(folder, runs):
    import open3d.core as core
    import open3d as o3d

    vertices, faces = columns(folder)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(core.Tensor(vertices), core.Tensor(faces))
    for name, file in (("in order", "points.f32"), ("shuffled", "shuffled.f32")):
        points = np.fromfile(folder / file, "<f4").reshape(-1, 3)
        query = core.Tensor(points)
        speed, found = rate(len(points), runs, lambda: scene.compute_closest_points(query, nthreads=1))
        print(f"RATE nearest, {name} | Open3D compute_closest_points | {speed}")
        if name == "in order":
            ours = np.fromfile(folder / "nearest.u32", "<u4")
            distances = np.fromfile(folder / "distances.f32", "<f4")
            theirs = np.linalg.norm(found["points"].numpy().astype(float) - points, axis=1)
            others = ours != found["primitive_ids"].numpy()
            print(f"NOTE {100 * others.mean():.3f} % of the points get another face than with Open3D; "
                  f"ours is farther by at most {max((distances - theirs).max(), 0):.1e} m, "
                  f"theirs by {max((theirs - distances).max(), 0):.1e} m")


def sample_open3d(folder, runs):
    import open3d.core as core
    import open3d as o3d

    vertices, faces = columns(folder)
    image, uvs = texture(folder)
    n = os.path.getsize(folder / "points.f32") // 12
    mesh = o3d.t.geometry.TriangleMesh(core.Tensor(vertices), core.Tensor(faces.astype(np.int64)))
    if image is not None:
        mesh.triangle.texture_uvs = core.Tensor(uvs)
        mesh.material.set_default_properties()
        mesh.material.texture_maps["albedo"] = o3d.t.geometry.Image(core.Tensor(image))
    speed, _ = rate(n, runs, lambda: mesh.sample_points_uniformly(n))
    print(f"RATE sampling with colour | Open3D sample_points_uniformly | {speed}")


def sample_trimesh(folder, runs):
    import trimesh
    from PIL import Image

    vertices, faces = columns(folder)
    image, uvs = texture(folder)
    n = os.path.getsize(folder / "points.f32") // 12 // SLOW_SHARE
    if image is not None:
        # A vertex of its own for every corner, so that each has one texture coordinate.
        visual = trimesh.visual.TextureVisuals(uv=uvs.reshape(-1, 2), image=Image.fromarray(image))
        corners = vertices[faces.reshape(-1)]
        mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False, visual=visual)
    else:
        mesh = trimesh.Trimesh(vertices, faces, process=False)
    work = lambda: trimesh.sample.sample_surface(mesh, n, sample_color=image is not None, seed=1)
    speed, _ = rate(n, runs, work)
    print(f"RATE sampling with colour | trimesh sample_surface | {speed}")


def sample_numpy(folder, runs):
    vertices, faces = columns(folder)
    n = os.path.getsize(folder / "points.f32") // 12
    random = np.random.default_rng(1)

    def work():
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        ends = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1).astype(float))
        face = np.searchsorted(ends, random.random(n) * ends[-1])
        u, v = random.random((2, n, 1), dtype=np.float32)
        u = np.sqrt(u)
        return a[face] * (1 - u) + b[face] * (u * (1 - v)) + c[face] * (u * v)

    speed, _ = rate(n, runs, work)
    print(f"RATE sampling with colour | numpy, without colour | {speed}")


PEERS = {f.__name__: f for f in (nearest_open3d, sample_open3d, sample_trimesh, sample_numpy)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh")
    parser.add_argument("--up", default="y", choices="yz")
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--peer", choices=PEERS)
    args = parser.parse_args()
    if args.peer:
        return PEERS[args.peer](Path(args.mesh), args.runs)
    # Two steps, so that the file's name is meant from where we are.
    cargo = ["cargo", "build", "--release", "--quiet", "-p", "s3d-io", "--example", "near_and_sample"]
    subprocess.run(cargo, cwd=REPOSITORY, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    with tempfile.TemporaryDirectory() as folder:
        example = [target / "release/examples/near_and_sample", args.mesh, args.up, str(args.points), folder]
        said = subprocess.run(example, check=True, capture_output=True, text=True).stdout.splitlines()
        print(said[0])
        ours = {}
        for line in said[1:]:
            what, figure = line[:22].strip(), line[22:].split()[0]
            ours[what] = float(figure)
        one = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        print(f"{'':24}{'':34}{'Mpt/s/core':>11}{'ours':>8}{'ratio':>8}")
        for peer in PEERS:
            command = [sys.executable, __file__, folder, "--runs", str(args.runs), "--peer", peer]
            done = subprocess.run(command, env=one, capture_output=True, text=True)
            for line in done.stdout.splitlines():
                if line.startswith("RATE "):
                    what, name, speed = line[5:].split(" | ")
                    mine, speed = ours[what], float(speed)
                    print(f"{what:24}{name:34}{speed:11.2f}{mine:8.2f}{mine / speed:7.1f}×")
                elif line.startswith("NOTE "):
                    print("  " + line[5:])
            if done.returncode:
                print(f"{peer}: not run: {(done.stderr.strip().splitlines() or ['?'])[-1]}")


main()
