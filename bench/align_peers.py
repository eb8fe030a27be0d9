"""Whether `s3d align` (its library, or the binary `s3d`) finds what Open3D's FPFH with RANSAC
finds, on the same pairs, and in what processor time.

    cargo run --release -p s3d-fusion --example align_pairs -- PAIRS shared/scans/copyroom/rgb.obj
    python3 -m venv o3d && o3d/bin/pip install open3d==0.19.0 numpy
    o3d/bin/python bench/align_peers.py target/release/examples/align_pairs PAIRS

An answer is right within 5 mm at the middle of the first part and 0.05°, and near within 5 cm and 1°. A pair is
refused if the program exits with 1. Open3D always answers; its answer counts as refused if less than a tenth of the
points of the first part have a partner within 5 cm. The time is the user's and system's: of the whole process, and
for Open3D without its import.
"""

import csv
import json
import os
import subprocess
import sys
import time
import tomllib

import numpy as np

# Points of Open3D's features, and of its last steps: with 5 cm for both, a pair of this size takes minutes.
VOXEL_M, FINE_M = 0.1, 0.05
LEAST_FITNESS = 0.1


def with_open3d(a, b):
    """Prints the transform that Open3D finds, and its fitness: the recipe of its tutorial on global registration."""
    import open3d as o3d

    before = time.process_time()
    o3d.utility.random.seed(0)
    registration = o3d.pipelines.registration

    def cloud_of(path, voxel_m):
        mesh = o3d.io.read_triangle_mesh(path)
        count = int(mesh.get_surface_area() * 800)
        cloud = mesh.sample_points_uniformly(count, use_triangle_normal=True).voxel_down_sample(voxel_m)
        sides = np.asarray(cloud.normals).copy()
        near = o3d.geometry.KDTreeSearchParamHybrid(2 * voxel_m, 30)
        cloud.estimate_normals(near)
        # To the side that the mesh shows.
        normals = np.asarray(cloud.normals)
        normals[np.einsum("ij,ij->i", normals, sides) < 0] *= -1
        return cloud

    cloud_a, cloud_b = (cloud_of(path, VOXEL_M) for path in (a, b))
    wide = o3d.geometry.KDTreeSearchParamHybrid(5 * VOXEL_M, 100)
    features_a, features_b = (registration.compute_fpfh_feature(cloud, wide) for cloud in (cloud_a, cloud_b))
    reach = 1.5 * VOXEL_M
    found = registration.registration_ransac_based_on_feature_matching(
        cloud_a, cloud_b, features_a, features_b, True, reach,
        registration.TransformationEstimationPointToPoint(False), 3,
        [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(reach),
        ],
        registration.RANSACConvergenceCriteria(100_000, 0.999),
    )  # fmt: skip
    plane = registration.TransformationEstimationPointToPlane()
    cloud_a, cloud_b = (cloud_of(path, FINE_M) for path in (a, b))
    for reach in (VOXEL_M, FINE_M, 0.4 * FINE_M):
        found = registration.registration_icp(cloud_a, cloud_b, reach, found.transformation, plane)
    fitness = registration.evaluate_registration(cloud_a, cloud_b, FINE_M, found.transformation).fitness
    print(np.asarray(found.transformation).tolist(), fitness, time.process_time() - before, sep="\n")


def timed(command):
    """Runs a command; returns its exit code, its output, and its processor seconds."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        text = process.stdout.read().decode()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        return process.returncode, text, usage.ru_utime + usage.ru_stime


def by_s3d(s3d, a, b):
    """Returns the transform or None, and processor seconds."""
    frame = ["--up-a", "z", "--up-b", "z", "--units-a", "m", "--units-b", "m"]
    frame = frame if os.path.basename(s3d) == "s3d" else []
    code, text, seconds = timed([s3d, "align", a, b, *frame])
    return (np.array(tomllib.loads(text)["transform"]) if code == 0 else None), seconds


def by_open3d(a, b):
    """Returns the transform or None, and processor seconds."""
    code, text, seconds = timed([sys.executable, __file__, "--open3d", a, b])
    if code != 0:
        return None, seconds
    transform, fitness, seconds = text.strip().split("\n")[-3:]
    found = np.array(json.loads(transform))
    return (found if float(fitness) >= LEAST_FITNESS else None), float(seconds)


def middle_of(path):
    """Returns the middle of the box of a part."""
    with open(path, "rb") as file:
        data = file.read()
    header = data[: data.index(b"end_header\n") + 11]
    count = int(next(line for line in header.split(b"\n") if line.startswith(b"element vertex")).split()[2])
    points = np.frombuffer(data, "<f4", 3 * count, len(header)).reshape(-1, 3).astype(float)
    return (points.min(0) + points.max(0)) / 2


def judged(found, truth, middle, is_pair):
    """Returns a word for an answer."""
    if found is None:
        return "refused"
    if not is_pair:
        return "wrong"
    off = np.linalg.norm(found[:3, :3] @ middle + found[:3, 3] - truth[:3, :3] @ middle - truth[:3, 3])
    turn = found[:3, :3] @ truth[:3, :3].T
    angle = np.degrees(np.arcsin(min(1.0, np.linalg.norm(turn - turn.T) / np.sqrt(8))))
    angle = angle if np.trace(turn) > 1 else 180 - angle
    if off <= 0.005 and angle <= 0.05:
        return "right"
    return "near" if off <= 0.05 and angle <= 1 else "wrong"


def main(s3d, folder, scenes=""):
    """Compares both on all pairs of a folder; Open3D, which takes long, on pairs of some scenes alone if they are named
    (copyroom,two_storeys)."""
    counts, seconds = {}, {}
    with open(os.path.join(folder, "pairs.csv"), newline="") as file:
        rows = list(csv.DictReader(file))
    both = [row for row in rows if row["name"].startswith(tuple(scenes.split(",")))]
    for row in both + [row for row in rows if row not in both]:
        a, b = (os.path.join(folder, f"{row['name']}_{part}.ply") for part in "ab")
        truth = np.array([[float(row[f"m{i}{j}"]) for j in range(4)] for i in range(3)])
        is_pair, middle = float(row["overlap"]) > 0, middle_of(a)
        line = f"{row['name']:16} overlap {float(row['overlap']):.2f}"
        answers = {"s3d": by_s3d(s3d, a, b)}
        if row in both:
            answers["Open3D"] = by_open3d(a, b)
        for program, (found, spent) in answers.items():
            word = judged(found, truth, middle, is_pair)
            key = (program, is_pair)
            counts.setdefault(key, {}).setdefault(word, 0)
            counts[key][word] += 1
            seconds.setdefault(program, []).append(spent)
            line += f"  {program} {word} {spent:.1f} s"
        print(line, flush=True)
    for (program, is_pair), words in counts.items():
        print(program, "pairs that overlap:" if is_pair else "pairs that do not:", words)
    for program, times in seconds.items():
        print(f"{program}: {sum(times):.0f} s of a processor, median {np.median(times):.1f} s")


if __name__ == "__main__":
    if sys.argv[1] == "--open3d":
        with_open3d(*sys.argv[2:])
    else:
        main(*sys.argv[1:])
