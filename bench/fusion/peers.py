"""Meshes from raw scans by Open3D: two grids of truncated signed distances, and screened Poisson.

    cargo build --release -p s3d-synth --example raw_scan
    RAW=target/release/examples/raw_scan
    $RAW tum freiburg1 --locations 2
    python3 bench/fusion/peers.py freiburg1 -o MESHES --score "$RAW tum freiburg1 --locations 2 --score"

Needs Linux, numpy and open3d. The first argument is a sequence of the TUM RGB-D benchmark, a folder of
Matterport's raw captures, or a folder with `scan.ptx`, as the example `raw_scan` of s3d-synth writes them. A
name with "freiburg1" tells readers the lens.

Every method runs in a process of its own with `--threads` threads. Told are the seconds from the first
picture to the mesh in memory without the reading of files, the seconds and processor seconds of the whole
process, and its peak memory. The mesh is written as MESHES/METHOD.ply. `--score` is a command that gets the
path of a mesh as its last word and prints JSON, which is told too.

To compare s3d: `/usr/bin/time -v s3d fuse freiburg1 -o ours.ply --threads 2`, then `$RAW tum freiburg1
--locations 2 --score ours.ply`. Threads, cell and range must be the same. `scenes.py` beside this file does
so for several scenes and devices.

| method | |
|---|---|
| `scalable` | `ScalableTSDFVolume`: cells of `--cell`, truncation 4 cells |
| `blocks` | `VoxelBlockGrid` on the CPU: the same, and corners of cells with more than `--weight` observations alone |
| `poisson10`, `poisson11` | one point a cell, normals towards the sensor; screened Poisson of that depth |

Open3D's `ScalableTSDFVolume` has no faces in version 0.20.0, even of a plane wall, and has them in 0.19.0. A
mesh without faces is told and not scored.

Both grids take depth pictures alone. So a laser scan becomes the six sides of a cube about the scanner, with
pixels as wide as the step of the scan, and ranges between its rays.

Poisson's vertices with the least density, 5 %, are left out. So are depths beyond `--range` metres for all
methods. Open3D counts pixels from the middle of the first one, and Matterport's intrinsics from its corner.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

METHODS = ["scalable", "blocks", "poisson10", "poisson11"]

# The lens that the TUM RGB-D benchmark recommends: width, height, fx, fy, cx, cy.
TUM_LENS = (640, 480, 525.0, 525.0, 319.5, 239.5)


def tum(folder):
    """Pictures of a sequence: colour, depth in metres, lens, camera → world."""
    import numpy as np

    def rows(name):
        lines = (folder / name).read_text().splitlines()
        return [line.split() for line in lines if line and not line.startswith("#")]

    lists = (rows(name) for name in ("rgb.txt", "depth.txt", "groundtruth.txt"))
    for (_, color), (_, depth), pose in zip(*lists, strict=True):
        x, y, z, qx, qy, qz, qw = map(float, pose[1:])
        turn = [
            [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)],
            [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)],
            [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)],
        ]
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn, (x, y, z)
        yield image(folder / color), image(folder / depth, 5000.0), TUM_LENS, matrix


def matterport(folder):
    """Pictures of Matterport's raw captures, like `tum`."""
    import numpy as np

    for path in sorted(folder.rglob("*_pose_*_*.txt")):
        uuid, _, camera, yaw = path.stem.split("_")
        find = lambda name: next(folder.rglob(name))
        numbers = find(f"{uuid}_intrinsics_{camera}.txt").read_text().split()
        w, h, fx, fy, cx, cy, *_ = map(float, numbers)
        lens = (int(w), int(h), fx, fy, cx - 0.5, cy - 0.5)
        of = f"{camera}_{yaw}"
        color, depth = (find(f"{uuid}_{kind}{of}.{end}") for kind, end in (("i", "jpg"), ("d", "png")))
        yield image(color), image(depth, 4000.0), lens, np.loadtxt(path)


def image(path, units=None):
    """The pixels of a picture; as metres if there are so many units in one."""
    import numpy as np
    import open3d as o3d

    pixels = np.asarray(o3d.io.read_image(str(path)))
    return pixels if units is None else (pixels / units).astype(np.float32)


def scans(file):
    """Scans of a PTX file: points by column and row, NaN where nothing came back, colours, scanner → world."""
    import numpy as np

    with open(file) as lines:
        while first := lines.readline().strip():
            columns, rows = int(first), int(lines.readline())
            header = [[float(v) for v in lines.readline().split()] for _ in range(8)]
            table = np.loadtxt(lines, max_rows=columns * rows, dtype=np.float32)
            table = table.reshape(columns, rows, -1)
            points = table[..., :3]
            points[(points == 0).all(-1)] = np.nan
            yield points, table[..., 4:7].astype(np.uint8), np.array(header[4:]).T


def regular(angles):
    """The angles of columns with equal steps between them, of which some may have seen nothing."""
    import numpy as np

    known = np.flatnonzero(np.isfinite(angles).any(axis=1))
    each = np.unwrap(np.nanmedian(angles[known], axis=1))
    step, first = np.polyfit(known, each, 1)
    return first + step * np.arange(len(angles))


def cube_sides(file):
    """Pictures of the sides of a cube about each place of a scanner, like `tum`."""
    import numpy as np

    for points, colors, matrix in scans(file):
        columns, rows, _ = points.shape
        ranges = np.linalg.norm(points, axis=-1)
        # Angles of columns and rows, and the fractional column and row of any angle.
        azimuth = regular(np.arctan2(points[..., 1], points[..., 0]))
        elevation = regular(np.arcsin(points[..., 2] / ranges).T)
        step = abs(elevation[-1] - elevation[0]) / (rows - 1)
        side = 2 * round(np.pi / 4 / step)
        y, x = np.mgrid[0:side, 0:side]
        flat = (np.stack([x, y], -1) - (side - 1) / 2) / (side / 2)

        # Forward and down of each side; OpenCV's axes are right, down and forward.
        up, down = np.array([0, 0, 1]), np.array([0, 0, -1])
        turns = [np.array([np.cos(a), np.sin(a), 0]) for a in (0, np.pi / 2, np.pi, -np.pi / 2)]
        for forward, below in [(f, down) for f in turns] + [(up, turns[0]), (down, -turns[0])]:
            right = np.cross(below, forward)
            rays = forward + flat[..., :1] * right + flat[..., 1:] * below
            length = np.linalg.norm(rays, axis=-1)
            turned = (np.arctan2(rays[..., 1], rays[..., 0]) - azimuth[0]) * np.sign(azimuth[1] - azimuth[0])
            c = turned % (2 * np.pi) / (2 * np.pi) * columns
            tilt = np.arcsin(rays[..., 2] / length)
            r = (tilt - elevation[0]) / (elevation[-1] - elevation[0]) * (rows - 1)
            is_seen = (r > -0.5) & (r < rows - 0.5)
            r = np.clip(r, 0, rows - 1)

            # Between four rays if they are on one surface, else the nearest.
            c0, r0 = np.floor(c).astype(int), np.minimum(np.floor(r).astype(int), rows - 2)
            u, v = c - c0, r - r0
            four = np.stack([ranges[(c0 + i) % columns, r0 + j] for i in (0, 1) for j in (0, 1)])
            shares = np.stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v])
            nearest = ranges[np.rint(c).astype(int) % columns, np.rint(r).astype(int)]
            is_one = four.max(0) - four.min(0) < 4 * step * four.min(0)
            found = np.where(is_one, (four * shares).sum(0), nearest)
            depth = np.where(is_seen, np.nan_to_num(found / length), 0).astype(np.float32)
            color = np.ascontiguousarray(colors[np.rint(c).astype(int) % columns, np.rint(r).astype(int)])

            pose = np.eye(4)
            pose[:3, :3] = np.stack([right, below, forward], axis=1)
            lens = (side, side, side / 2, side / 2, (side - 1) / 2, (side - 1) / 2)
            yield color, depth, lens, matrix @ pose


def pictures(folder):
    if (folder / "scan.ptx").exists():
        return cube_sides(folder / "scan.ptx")
    return tum(folder) if (folder / "depth.txt").exists() else matterport(folder)


def clouds(folder, reach):
    """Points with colours of each place of a sensor, and the place. Beyond `reach` metres they are left out."""
    import numpy as np
    import open3d as o3d

    if (folder / "scan.ptx").exists():
        for points, colors, matrix in scans(folder / "scan.ptx"):
            is_point = np.linalg.norm(points, axis=-1) < reach
            cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points[is_point].astype(float)))
            cloud.colors = o3d.utility.Vector3dVector(colors[is_point] / 255)
            yield cloud.transform(matrix), matrix[:3, 3]
        return
    for color, depth, lens, matrix in pictures(folder):
        lens = o3d.camera.PinholeCameraIntrinsic(*lens)
        cloud = o3d.geometry.PointCloud.create_from_rgbd_image(
            rgbd(color, depth, reach), lens, np.linalg.inv(matrix))
        yield cloud, matrix[:3, 3]


def rgbd(color, depth, reach):
    import open3d as o3d

    return o3d.geometry.RGBDImage.create_from_color_and_depth(
        o3d.geometry.Image(color), o3d.geometry.Image(depth), depth_scale=1.0, depth_trunc=reach,
        convert_rgb_to_intensity=False)


class Clock:
    """Adds up the seconds spent within it."""

    def __init__(self):
        self.seconds = 0.0

    def __enter__(self):
        self.began = time.perf_counter()

    def __exit__(self, *_):
        self.seconds += time.perf_counter() - self.began


def scalable(args, clock):
    import numpy as np
    import open3d as o3d

    color_type = o3d.pipelines.integration.TSDFVolumeColorType.RGB8
    volume = o3d.pipelines.integration.ScalableTSDFVolume(args.cell, 4 * args.cell, color_type)
    for color, depth, lens, matrix in pictures(args.scan):
        with clock:
            lens = o3d.camera.PinholeCameraIntrinsic(*lens)
            volume.integrate(rgbd(color, depth, args.range), lens, np.linalg.inv(matrix))
    with clock:
        return volume.extract_triangle_mesh()


def blocks(args, clock):
    import numpy as np
    import open3d as o3d

    core = o3d.core
    device = core.Device("CPU:0")
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight", "color"),
        attr_dtypes=(core.float32, core.float32, core.float32),
        attr_channels=((1), (1), (3)),
        voxel_size=args.cell, block_resolution=16, block_count=20_000, device=device)
    for color, depth, lens, matrix in pictures(args.scan):
        # A picture of nothing is an error to it.
        if not ((depth > 0) & (depth < args.range)).any():
            continue
        color, depth = (o3d.t.geometry.Image(pixels) for pixels in ((color / 255).astype(np.float32), depth))
        _, _, fx, fy, cx, cy = lens
        with clock:
            intrinsic = core.Tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], core.float64)
            extrinsic = core.Tensor(np.linalg.inv(matrix), core.float64)
            found = grid.compute_unique_block_coordinates(depth, intrinsic, extrinsic, 1.0, args.range, 4.0)
            grid.integrate(found, depth, color, intrinsic, intrinsic, extrinsic, 1.0, args.range, 4.0)
    with clock:
        return grid.extract_triangle_mesh(weight_threshold=args.weight).to_legacy()


def poisson(args, clock, octree):
    import numpy as np
    import open3d as o3d

    cloud = o3d.geometry.PointCloud()
    for piece, place in clouds(args.scan, args.range):
        with clock:
            piece = piece.voxel_down_sample(args.cell)
            if len(piece.points) < 30:
                continue
            piece.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=6 * args.cell, max_nn=40))
            piece.orient_normals_towards_camera_location(place)
            cloud += piece
            # Few pictures at a time, so that memory does not grow with their number.
            if len(cloud.points) > 4_000_000:
                cloud = cloud.voxel_down_sample(args.cell)
    with clock:
        cloud = cloud.voxel_down_sample(args.cell)
        cloud.normalize_normals()
        make = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson
        mesh, density = make(cloud, depth=octree, n_threads=args.threads)
        density = np.asarray(density)
        mesh.remove_vertices_by_mask(density < np.quantile(density, 0.05))
        return mesh.crop(cloud.get_axis_aligned_bounding_box())


def one(args):
    """Runs a method in this process and prints what it took as JSON."""
    import open3d as o3d

    clock = Clock()
    if args.one.startswith("poisson"):
        mesh = poisson(args, clock, int(args.one.removeprefix("poisson")))
    else:
        mesh = {"scalable": scalable, "blocks": blocks}[args.one](args, clock)
    o3d.io.write_triangle_mesh(str(args.out / f"{args.one}.ply"), mesh)
    print(json.dumps({"seconds": round(clock.seconds, 2), "faces": len(mesh.triangles)}))


def measured(command, threads, prints_json=True):
    """Runs a command: the JSON in its last line, and what the process took."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    began = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        child = subprocess.Popen(command, stdout=output, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            raise SystemExit(f"{' '.join(command)} failed")
        output.seek(0)
        line = output.read().strip().splitlines()[-1] if prints_json else "null"
    taken = {
        "process_seconds": round(time.perf_counter() - began, 1),
        "processor_seconds": round(usage.ru_utime + usage.ru_stime, 1),
        "peak_mb": round(usage.ru_maxrss * 1024 / 1e6),
    }
    return json.loads(line), taken


def main():
    text = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=text)
    parser.add_argument("scan", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS)
    parser.add_argument("--cell", type=float, default=0.01)
    parser.add_argument("--range", type=float, default=5.0)
    parser.add_argument("--weight", type=float, default=3.0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--score", help="a command that prints JSON about a mesh")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if args.one:
        return one(args)

    for method in args.methods:
        command = [sys.executable, __file__, str(args.scan), "-o", str(args.out), "--one", method]
        for option in ("cell", "range", "weight", "threads"):
            command += [f"--{option}", str(getattr(args, option))]
        said, taken = measured(command, args.threads)
        told = {"method": method, **said, **taken}
        if args.score and told["faces"]:
            words = [*args.score.split(), str(args.out / f"{method}.ply")]
            told["scores"] = measured(words, args.threads)[0]
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main()
