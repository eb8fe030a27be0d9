"""Any rays in Python: `s3d_py.Scene.cast` and Open3D's `RaycastingScene`, in turns, in one process, on one thread.

    python3 bench/python_cast.py DATASET [--rounds N]

Needs s3d_py of a release build, and open3d. DATASET is a folder that `s3d export` or `s3d demo` made. Told is the processor
time of a ray, the median of the rounds, and the share of rays for which both name the same face. Rays are those of a camera
(coherent), from one place to all sides, and from anywhere to anywhere.
"""

import argparse
import time

import numpy as np
import open3d as o3d
import s3d_py as s3d

RAYS = 400_000


def seconds(call):
    """Processor time of a call, and its result."""
    began = time.process_time()
    result = call()
    return time.process_time() - began, result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset")
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    data = s3d.open(args.dataset)
    mesh = data.mesh(data.areas[0])
    scene = s3d.Scene(mesh)
    peer = o3d.t.geometry.RaycastingScene(nthreads=1)
    peer.add_triangles(o3d.core.Tensor(mesh.vertices.copy()), o3d.core.Tensor(mesh.faces.copy()))

    rng = np.random.default_rng(0)
    eye = s3d.FreeSpace().place(scene, rng)
    side = int(RAYS**0.5)
    K, pose = s3d.intrinsics((side, side), 75), s3d.look_at(eye, eye + [1.0, 0.3, -0.1])
    y, x = np.mgrid[0:side, 0:side] + 0.5
    ahead = np.stack([(x.ravel() - K[0, 2]) / K[0, 0], (y.ravel() - K[1, 2]) / K[1, 1], np.ones(side * side)], 1)
    ahead = ahead @ pose[:3, :3].T
    anywhere = rng.uniform(*mesh.bounds.astype(float), (RAYS, 3)), rng.normal(size=(RAYS, 3))
    around = rng.normal(size=(RAYS, 3))
    sets = {
        "a camera's": (np.tile(eye, (len(ahead), 1)), ahead),
        "one place, all sides": (np.tile(eye, (RAYS, 1)), around),
        "anywhere": anywhere,
    }
    print(mesh)
    for name, (origins, directions) in sets.items():
        rays = o3d.core.Tensor(np.concatenate([origins, directions], 1).astype(np.float32))
        scene.cast(origins[:10], directions[:10], threads=1)
        ours, theirs = [], []
        for _ in range(args.rounds):
            taken, hits = seconds(lambda: scene.cast(origins, directions, threads=1))
            ours.append(taken)
            taken, found = seconds(lambda: peer.cast_rays(rays, nthreads=1))
            theirs.append(taken)
        same = (hits.face == found["primitive_ids"].numpy().view(np.int32)).mean()
        a, b = (1e9 * np.median(taken) / len(directions) for taken in (ours, theirs))
        print(f"{name:<22} s3d {a:5.0f} ns   Open3D {b:5.0f} ns   {a / b:.2f} times   same faces {same:.6f}")


if __name__ == "__main__":
    main()
