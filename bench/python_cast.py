"""Rays and nearest points in Python: `s3d_py.Scene` and Open3D's `RaycastingScene`, in turns, in one process, on one thread.

    python3 bench/python_cast.py DATASET [--rounds N]

Needs s3d_py of a release build, and open3d. DATASET is a folder that `s3d export` or `s3d demo` made. Told is the processor
time of a ray or point, the median of the rounds, and the share for which both answer the same: the face that is hit, whether
one is, how many are, the distance to a millimetre. Rays are those of a camera (coherent), from one place to all sides, and from
anywhere to anywhere. Distances with signs are those of a generated ball of 638,400 faces.
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
        compare(
            f"{name}: first hits",
            len(directions),
            args.rounds,
            lambda: scene.cast(origins, directions, threads=1).face,
            lambda: peer.cast_rays(rays, nthreads=1)["primitive_ids"].numpy().view(np.int32),
        )
        compare(
            f"{name}: any hit",
            len(directions),
            args.rounds,
            lambda: scene.test_occlusions(origins, directions, threads=1),
            lambda: peer.test_occlusions(rays, nthreads=1).numpy(),
        )
        compare(
            f"{name}: number of hits",
            len(directions),
            args.rounds,
            lambda: scene.count_intersections(origins, directions, threads=1),
            lambda: peer.count_intersections(rays, nthreads=1).numpy(),
        )

    points = anywhere[0].astype(np.float32)
    tensor = o3d.core.Tensor(points)
    compare(
        "nearest places",
        len(points),
        args.rounds,
        lambda: scene.closest_points(points, threads=1).distance,
        lambda: peer.compute_distance(tensor, nthreads=1).numpy(),
    )
    ball = o3d.geometry.TriangleMesh.create_sphere(1.0, 400)
    closed = s3d.Scene(ball)
    of_ball = o3d.t.geometry.RaycastingScene(nthreads=1)
    of_ball.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(ball))
    points = rng.uniform(-1.2, 1.2, (RAYS, 3)).astype(np.float32)
    tensor = o3d.core.Tensor(points)
    compare(
        "signed distances",
        len(points),
        args.rounds,
        lambda: closed.signed_distance(points, threads=1),
        lambda: of_ball.compute_signed_distance(tensor, nthreads=1, nsamples=3).numpy(),
    )


def compare(name, count, rounds, ours, theirs):
    """Times both in turns, and prints a line. The first calls, which build trees, are not timed."""
    ours(), theirs()
    taken = []
    for _ in range(rounds):
        (a, found), (b, expected) = seconds(ours), seconds(theirs)
        taken.append((a, b))
    is_same = abs(found - expected) < 1e-3 if found.dtype.kind == "f" else found == expected
    a, b = 1e9 * np.median(taken, axis=0) / count
    print(f"{name:<40} s3d {a:5.0f} ns   Open3D {b:5.0f} ns   {a / b:.2f} times   same {is_same.mean():.6f}")


if __name__ == "__main__":
    main()
