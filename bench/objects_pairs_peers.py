"""Objects and pairs of ten views against Open3D's rays, in one run.

    cargo build --release -p s3d-cli
    python3 bench/objects_pairs_peers.py SCENE.toml [--s3d PROGRAM] [--size 1080] [--rounds 3]

Needs Linux, numpy, Pillow, pycocotools and open3d (which has Embree). SCENE has labels. Times are processor seconds, the
median of rounds in turns.

Objects. Ours: what `--modalities objects` adds to an export of the same views (two exports, the same but for it). Open3D:
the same numbers of each view by its own rays: the label of each pixel, and for each label in view the mask it would have
alone (rays of the pixels that the box of its vertices covers, against its faces alone), both boxes, run lengths, what hides
it, distances. Building its scenes is not counted. Both must find the same instances, and masks of the same size.

Pairs. Ours: `s3d pairs`, with reading the data set. Open3D: for each of the 90 ordered pairs, on the same grid of about
400 pixels: the point of each pixel, whether it lies in the other view, and a ray that tells whether it is seen from there.
"""

import argparse
import json
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import open3d as o3d
from pycocotools import mask as coco

VIEWS = 10


def ours(command):
    """The processor seconds of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def read_semantic_obj(path):
    """Corners in the world, faces, and the label of each face."""
    corners, faces, labels, label = [], [], [], None
    for line in path.read_text().splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            x, y, z = map(float, rest.split()[:3])
            corners.append((x, -z, y))
        elif word == "usemtl":
            label = rest.strip()
        elif word == "f":
            faces.append([int(corner.split("/")[0]) - 1 for corner in rest.split()])
            labels.append(label)
    return np.array(corners, np.float32), np.array(faces, np.uint32), np.array(labels)


def scene_of(corners, faces):
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(corners), o3d.core.Tensor(np.ascontiguousarray(faces)))
    return scene


class View:
    def __init__(self, path, size):
        pose = json.loads(path.read_text())
        self.k, self.rt = np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"])
        self.center = -self.rt[:, :3].T @ self.rt[:, 3]
        self.size = size
        axis = np.arange(size) + 0.5
        x, y = np.meshgrid((axis - self.k[0, 2]) / self.k[0, 0], (axis - self.k[1, 2]) / self.k[1, 1])
        directions = np.stack([x, y, np.ones_like(x)], axis=-1) @ self.rt[:, :3]
        self.rays = np.concatenate([np.broadcast_to(self.center, directions.shape), directions], axis=-1)
        self.rays = self.rays.astype(np.float32)
        self.lengths = np.linalg.norm(directions, axis=-1)

    def project(self, points):
        local = points @ self.rt[:, :3].T + self.rt[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = local[:, :2] / local[:, 2:] * [self.k[0, 0], self.k[1, 1]] + self.k[:2, 2]
        return pixels, local[:, 2]


def box(mask):
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return [columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1]


def objects_of(view, whole, label_of_face, alone, corners_of):
    """What an objects file tells of a view, but for corners of boxes."""
    hits = whole.cast_rays(o3d.core.Tensor(view.rays))
    face, depth = hits["primitive_ids"].numpy(), hits["t_hit"].numpy()
    label = np.where(face < len(label_of_face), label_of_face[np.minimum(face, len(label_of_face) - 1)], -1)
    found = {}
    for index in np.unique(label[label >= 0]):
        visible = label == index
        pixels, z = view.project(corners_of[index])
        low, high = np.array([0, 0]), np.array([view.size, view.size])
        if (z > 1e-3).all():
            low = np.clip(np.floor(pixels.min(axis=0)), 0, view.size).astype(int)
            high = np.clip(np.ceil(pixels.max(axis=0)), 0, view.size).astype(int)
        part = (slice(low[1], high[1]), slice(low[0], high[0]))
        amodal = np.zeros_like(visible)
        seen = alone[index].cast_rays(o3d.core.Tensor(np.ascontiguousarray(view.rays[part])))
        amodal[part] = np.isfinite(seen["t_hit"].numpy())
        amodal |= visible
        distances = np.sort(depth[visible] * view.lengths[visible])
        hiders, counts = np.unique(label[amodal & ~visible], return_counts=True)
        found[int(index)] = {
            "visible_pixels": int(visible.sum()),
            "visible_box": box(visible),
            "amodal_pixels": int(amodal.sum()),
            "amodal_box": box(amodal),
            "amodal_mask": coco.encode(np.asfortranarray(amodal)),
            "hidden_by": sorted(zip(counts, hiders), reverse=True),
            "nearest_m": distances[0],
            "median_m": distances[(len(distances) - 1) // 2],
        }
    return found


def pairs_of(views, whole):
    """Of each ordered pair the share of the first view's points that the second one sees."""
    shares = np.zeros((len(views), len(views)))
    step = max(round(views[0].size / 20), 1)
    for i, view in enumerate(views):
        rays = np.ascontiguousarray(view.rays[step // 2 :: step, step // 2 :: step].reshape(-1, 6))
        hits = whole.cast_rays(o3d.core.Tensor(rays))
        depth = hits["t_hit"].numpy()
        points = rays[:, :3] + rays[:, 3:] * np.where(np.isfinite(depth), depth, 0)[:, None]
        for j, other in enumerate(views):
            if i == j:
                continue
            pixels, z = other.project(points)
            inside = np.isfinite(depth) & (z > 0) & ((pixels >= 0) & (pixels < other.size)).all(axis=1)
            back = np.broadcast_to(other.center, points[inside].shape)
            to_point = np.concatenate([back, points[inside] - back], axis=1).astype(np.float32)
            reached = whole.cast_rays(o3d.core.Tensor(to_point))["t_hit"].numpy() > 0.999
            shares[i, j] = reached.sum() / len(rays)
    return shares


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--s3d", type=Path, default=Path(__file__).parent.parent / "target/release/s3d")
    parser.add_argument("--size", type=int, default=1080)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()

    scratch = Path(tempfile.mkdtemp())
    usual = ["-o", scratch / "out", "--size", options.size, "--views", 6, "--pano-width", 512, "--overwrite", "--threads", 1]
    export = [options.s3d, "export", options.scene, *usual, "--modalities"]
    ours([*export, "semantic,objects,pose"])
    out = scratch / "out"
    poses = sorted((out / "area_1/data/pose").glob("*.json"))
    chosen = [poses[i] for i in np.linspace(0, len(poses) - 1, VIEWS).astype(int)]
    views = [View(path, options.size) for path in chosen]

    corners, faces, names = read_semantic_obj(out / "area_1/3d/semantic.obj")
    table = json.loads((out / "assets/semantic_labels.json").read_text())
    index = {name: i for i, name in enumerate(table)}
    label_of_face = np.array([index.get(name, 0) for name in names])
    label_of_face[label_of_face == 0] = -1
    whole = scene_of(corners, faces)
    labels = np.unique(label_of_face[label_of_face >= 0])
    alone = {label: scene_of(corners, faces[label_of_face == label]) for label in labels}
    corners_of = {label: corners[np.unique(faces[label_of_face == label])] for label in labels}

    seconds = {name: [] for name in ["objects, ours", "objects, Open3D", "pairs, ours", "pairs, Open3D"]}
    images = len(poses) + len(list((out / "area_1/pano/pose").glob("*.json")))
    for _ in range(options.rounds):
        without = ours([*export, "semantic,pose"])
        with_objects = ours([*export, "semantic,objects,pose"])
        seconds["objects, ours"].append((with_objects - without) / images * VIEWS)
        began = time.process_time()
        found = [objects_of(view, whole, label_of_face, alone, corners_of) for view in views]
        seconds["objects, Open3D"].append(time.process_time() - began)

        images_of_pairs = len(list((out / "area_1").glob("*/pose/*.json")))
        pairs = ours([options.s3d, "pairs", out, "--overwrite", "--threads", 1])
        seconds["pairs, ours"].append(pairs / (images_of_pairs * (images_of_pairs - 1)))
        began = time.process_time()
        shares = pairs_of(views, whole)
        seconds["pairs, Open3D"].append((time.process_time() - began) / (VIEWS * (VIEWS - 1)))

    same = total = 0
    worst = 0.0
    for path, own in zip(chosen, found):
        file = out / "area_1/data/objects" / path.name.replace("_pose", "_objects")
        told = {thing["label_index"]: thing for thing in json.loads(file.read_text())["objects"]}
        total += len(told)
        for label in told.keys() & own.keys():
            same += 1
            difference = abs(told[label]["amodal_pixels"] - own[label]["amodal_pixels"])
            worst = max(worst, difference / max(told[label]["amodal_pixels"], 1000))
    print(f"{len(faces)} faces, {images} images of {options.size}²; {same} of {total} instances are found by both; "
          f"masks differ by {worst:.2%} at most; mean overlap {shares.mean():.3f}")
    for name, values in seconds.items():
        scale, unit = (100, "ms a view") if name.startswith("objects") else (1e6, "µs an ordered pair")
        print(f"{name}: {statistics.median(values) * scale:.1f} {unit}")
    shutil.rmtree(scratch)


main()
