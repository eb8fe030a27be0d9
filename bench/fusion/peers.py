"""Meshes from depth pictures by Open3D: two grids of truncated signed distances, and screened Poisson.

    cargo build --release -p s3d-synth --example raw_scan
    RAW=target/release/examples/raw_scan
    $RAW tum freiburg1 --locations 2
    python3 bench/fusion/peers.py freiburg1 -o MESHES --score "$RAW tum freiburg1 --locations 2 --score"

Needs Linux, numpy and open3d. The first argument is a sequence of the TUM RGB-D benchmark, or a folder of
Matterport's raw captures, as the example `raw_scan` of s3d-synth writes them. A name with "freiburg1" tells
readers the lens.

Every method runs in a process of its own with `--threads` threads. Told are the seconds from the first
picture to the mesh in memory without the reading of files, the seconds and processor seconds of the whole
process, and its peak memory. The mesh is written as MESHES/METHOD.ply. `--score` is a command that gets the
path of a mesh as its last word and prints JSON, which is told too.

To compare s3d: `/usr/bin/time -v s3d fuse freiburg1 -o ours.ply --threads 2`, then `$RAW tum freiburg1
--locations 2 --score ours.ply`. Threads, cell and range must be the same.

| method | |
|---|---|
| `scalable` | `ScalableTSDFVolume`: cells of `--cell`, truncation 4 cells |
| `blocks` | `VoxelBlockGrid` on the CPU: the same, and cells with `--weight` observations alone |
| `poisson10`, `poisson11` | one point a cell, normals towards the camera; screened Poisson of that depth |

Open3D 0.20.0 returns a `ScalableTSDFVolume` without faces, even of a plane wall: try another version. A mesh
without faces is told and not scored.

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
    """Pictures of a sequence: colour, depth, lens, camera → world, units a metre."""
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
        yield folder / color, folder / depth, TUM_LENS, matrix, 5000.0


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
        yield find(f"{uuid}_i{of}.jpg"), find(f"{uuid}_d{of}.png"), lens, np.loadtxt(path), 4000.0


def pictures(folder):
    return tum(folder) if (folder / "depth.txt").exists() else matterport(folder)


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
    for color, depth, lens, matrix, scale in pictures(args.scan):
        color, depth = o3d.io.read_image(str(color)), o3d.io.read_image(str(depth))
        with clock:
            image = o3d.geometry.RGBDImage.create_from_color_and_depth(
                color, depth, depth_scale=scale, depth_trunc=args.range, convert_rgb_to_intensity=False)
            volume.integrate(image, o3d.camera.PinholeCameraIntrinsic(*lens), np.linalg.inv(matrix))
    with clock:
        return volume.extract_triangle_mesh()


def blocks(args, clock):
    import numpy as np
    import open3d as o3d

    core = o3d.core
    device = core.Device("CPU:0")
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight", "color"),
        attr_dtypes=(core.float32, core.uint16, core.uint16),
        attr_channels=((1), (1), (3)),
        voxel_size=args.cell, block_resolution=16, block_count=20_000, device=device)
    for color, depth, lens, matrix, scale in pictures(args.scan):
        color, depth = o3d.t.io.read_image(str(color)), o3d.t.io.read_image(str(depth))
        _, _, fx, fy, cx, cy = lens
        with clock:
            intrinsic = core.Tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], core.float64)
            extrinsic = core.Tensor(np.linalg.inv(matrix), core.float64)
            found = grid.compute_unique_block_coordinates(depth, intrinsic, extrinsic, scale, args.range, 4.0)
            grid.integrate(found, depth, color, intrinsic, intrinsic, extrinsic, scale, args.range, 4.0)
    with clock:
        return grid.extract_triangle_mesh(weight_threshold=args.weight).to_legacy()


def poisson(args, clock, octree):
    import numpy as np
    import open3d as o3d

    cloud = o3d.geometry.PointCloud()
    for color, depth, lens, matrix, scale in pictures(args.scan):
        color, depth = o3d.io.read_image(str(color)), o3d.io.read_image(str(depth))
        with clock:
            image = o3d.geometry.RGBDImage.create_from_color_and_depth(
                color, depth, depth_scale=scale, depth_trunc=args.range, convert_rgb_to_intensity=False)
            lens = o3d.camera.PinholeCameraIntrinsic(*lens)
            piece = o3d.geometry.PointCloud.create_from_rgbd_image(image, lens, np.linalg.inv(matrix))
            piece = piece.voxel_down_sample(args.cell)
            if len(piece.points) < 30:
                continue
            piece.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=6 * args.cell, max_nn=40))
            piece.orient_normals_towards_camera_location(matrix[:3, 3])
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


def measured(command, threads):
    """Runs a command: its last line, and what the process took."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    began = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        child = subprocess.Popen(command, stdout=output, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            raise SystemExit(f"{' '.join(command)} failed")
        output.seek(0)
        line = output.read().strip().splitlines()[-1]
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
