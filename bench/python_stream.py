"""How long a rendered sample takes, beside decoding the same images from PNG files with OpenCV.

    pip install ./s3d-py opencv-python-headless
    python3 bench/python_stream.py DATASET [--size 512] [--samples 60]

DATASET is a folder that `s3d export` or `s3d demo` made. One thread. A sample has RGB, depth, normals and classes of a
view of `s3d_py.RenderedViews`. The same images are written as PNG files by OpenCV, as 2D-3D-S stores them: RGB and normals
in 8 bits, depth in 16, classes as 24 bits of label indices. They are decoded in turns with the rendering; told are
medians of processor time in milliseconds.
"""

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
import cv2
import numpy as np
import s3d_py as s3d

WORDS = ["rgb", "depth", "normal", "classes"]


def array(value):
    return np.asarray(value)


def write(folder, sample):
    """Writes the images of a sample as a data set has them, and returns their paths."""
    rgb = array(sample["rgb"]).transpose(1, 2, 0)[:, :, ::-1]
    depth = np.nan_to_num(array(sample["depth"]) * 512, nan=65535).astype(np.uint16)
    normal = np.nan_to_num(127.5 + 127.5 * array(sample["normal"]).transpose(1, 2, 0), nan=128).astype(np.uint8)
    index = array(sample["classes"]) + 1
    semantic = np.stack([index & 255, index >> 8 & 255, index >> 16], -1).astype(np.uint8)
    paths = [folder / f"{name}.png" for name in WORDS]
    for path, image in zip(paths, (rgb, depth, normal, semantic)):
        assert cv2.imwrite(str(path), np.ascontiguousarray(image))
    return [str(path) for path in paths]


def decode(paths):
    """Decodes to the arrays of a sample."""
    rgb, depth, normal, semantic = (cv2.imread(path, cv2.IMREAD_UNCHANGED) for path in paths)
    metres = np.where(depth == 65535, np.nan, depth / np.float32(512))
    vectors = (normal.astype(np.float32) - 127.5) / 127.5
    index = semantic.astype(np.int64) @ np.array([1, 256, 65536]) - 1
    return np.ascontiguousarray(rgb[:, :, ::-1].transpose(2, 0, 1)), metres, vectors.transpose(2, 0, 1), index


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--samples", type=int, default=60)
    args = parser.parse_args()
    cv2.setNumThreads(1)

    data = s3d.open(args.dataset)
    size = (args.size, args.size)
    views = {
        "paper": s3d.RenderedViews(data, size=size, modalities=WORDS, area=data.areas[0]),
        "free space": s3d.RenderedViews(data, size=size, modalities=WORDS, area=data.areas[0], sampler="free_space"),
    }
    taken = {name: [] for name in [*views, "decoding"]}
    with tempfile.TemporaryDirectory() as folder:
        for sampled in views.values():
            sampled[0]
        for index in range(args.samples):
            for name, sampled in views.items():
                start = time.process_time()
                sample = sampled[index]
                taken[name].append(time.process_time() - start)
            paths = write(Path(folder), sample)
            start = time.process_time()
            decode(paths)
            taken["decoding"].append(time.process_time() - start)
    faces = len(data.mesh(data.areas[0]).faces)
    print(f"{faces:,} faces, {args.size} × {args.size}, medians of {args.samples} samples in milliseconds")
    for name, seconds in taken.items():
        print(f"  {name:<12} {1000 * statistics.median(seconds):7.2f}")


if __name__ == "__main__":
    main()
