"""Views in Python: `s3d_py.Scene.render` and Open3D's `RaycastingScene`, in turns, in one process.

    python3 bench/python_render.py OFFICE/scene.obj --up z --at X,Y,Z [--rounds N] [--size PX] [--views N]

Needs s3d_py of a release build, and open3d for the second half. Views of a place, each of SIZE² pixels and 75°; seconds are
processor time of the process, so that other work on the machine disturbs little. Open3D gets its rays ready-made, on one thread,
and makes depth and normals alone.
"""

import argparse
import time

import numpy as np
import s3d_py as s3d


def seconds(call):
    """Processor time of a call."""
    began = time.process_time()
    call()
    return time.process_time() - began


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("--up", default="y")
    parser.add_argument("--at", required=True, type=lambda text: np.array([float(x) for x in text.split(",")]))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--size", type=int, default=1080)
    parser.add_argument("--views", type=int, default=12)
    args = parser.parse_args()
    mesh = s3d.read_mesh(args.mesh, up=args.up)
    scene = s3d.Scene(mesh)
    size, K = (args.size, args.size), s3d.intrinsics((args.size, args.size), 75)
    angles = 2 * np.pi * np.arange(args.views) / args.views
    poses = [s3d.look_at(args.at, args.at + [np.cos(a), np.sin(a), -0.2]) for a in angles]

    def render(*modalities):
        return lambda: [scene.render(K, pose, size, modalities=modalities) for pose in poses]

    kinds = (("rgb", "depth", "normal"), ("depth", "normal"), ("depth",), ("rgb", "depth", "face"))
    ways = {" + ".join(m): render(*m) for m in kinds}
    for m in kinds[2:]:
        ways[f"stack of {' + '.join(m)}"] = lambda m=m: scene.render_stack(poses, K, size, modalities=m, threads=1)
    try:
        import open3d as o3d
    except ImportError:
        print("open3d is not installed")
    else:
        peer = o3d.t.geometry.RaycastingScene(nthreads=1)
        peer.add_triangles(o3d.core.Tensor(mesh.vertices.copy()), o3d.core.Tensor(mesh.faces.copy()))
        rays = [
            peer.create_rays_pinhole(o3d.core.Tensor(K), o3d.core.Tensor(np.linalg.inv(pose)), *size) for pose in poses
        ]
        ways["Open3D: depth, normal"] = lambda: [peer.cast_rays(each, nthreads=1) for each in rays]
    print(f"{mesh}, {size[0]} × {size[1]}")
    for name, way in ways.items():
        way()
    taken = {name: [] for name in ways}
    for _ in range(args.rounds):
        for name, way in ways.items():
            taken[name].append(seconds(way) / len(poses))
    for name, times in taken.items():
        median = np.median(times)
        print(f"{name:30} {1e3 * median:7.2f} ms a view ({1e3 * min(times):.2f} to {1e3 * max(times):.2f}), {1 / median:6.1f} a second")


if __name__ == "__main__":
    main()
