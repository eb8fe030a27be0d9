"""Refined labels of images whose truth is known, by dense CRFs: what `examples/refined_labels` measures of s3d.

    cargo run --release -p s3d-dataset --example refined_labels -- 540 10 FOLDER
    pip install numpy scipy pydensecrf2            # or pydensecrf
    python3 bench/refined_labels_peers.py FOLDER [N]   # every Nth image

Each file has the result of s3d, too. pydensecrf is the code of Krähenbühl and Koltun (2011). Its unaries are the
projected labels with the certainty that its authors use for annotations; its kernels have the parameters of its example
for images, and narrower ones. Every label of an image is a class of the CRF. Printed: the share of wrong pixels within
8 pixels of a true border, how many of those of `semantic` are gone, and the wrong pixels of thin things.
"""

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from pydensecrf import densecrf
from pydensecrf.utils import unary_from_labels
from scipy.ndimage import distance_transform_cdt

NONE = 0xFFFFFFFF
# Certainty of the labels; standard deviations of places and colours, and weights, of both kernels.
PEERS = {
    "pydensecrf, as its example": (0.7, (3, 3), (80, 13, 10)),
    "pydensecrf, narrow": (0.7, (2, 2), (20, 13, 5)),
    "pydensecrf, narrow and sure": (0.9, (2, 2), (20, 13, 5)),
}


def read(path):
    data = path.read_bytes()
    width = int(np.frombuffer(data, np.uint32, 1)[0])
    pixels = (len(data) - 4) // 15
    shape = (pixels // width, width)
    images = np.frombuffer(data, np.uint32, 3 * pixels, 4).reshape(3, *shape)
    return *images, np.frombuffer(data, np.uint8, 3 * pixels, 4 + 12 * pixels).reshape(*shape, 3)


def near_and_thin(truth):
    """Pixels within 8 pixels of a true border, and those of things that are nowhere wider than 9."""
    border = np.zeros(truth.shape, bool)
    for a, b in [(np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])]:
        border[a] |= (truth[a] != truth[b]) & (truth[a] != NONE) & (truth[b] != NONE)
    distance = distance_transform_cdt(~border, "chessboard")
    thin = np.zeros(truth.shape, bool)
    for label in np.unique(truth):
        core = (truth == label) & (distance >= 4)
        away = distance_transform_cdt(~core, "chessboard") if core.any() else np.full(truth.shape, 99)
        thin |= (truth == label) & (away > 6) & (distance <= 4)
    return distance <= 8, thin


def refined(labels, colors, peer):
    sure, place, look = peer
    known, index = np.unique(labels, return_inverse=True)
    height, width = labels.shape
    crf = densecrf.DenseCRF2D(width, height, len(known))
    unary = unary_from_labels(index.reshape(-1), len(known), gt_prob=sure, zero_unsure=False)
    crf.setUnaryEnergy(np.ascontiguousarray(unary))
    crf.addPairwiseGaussian(sxy=place[0], compat=place[1])
    crf.addPairwiseBilateral(sxy=look[0], srgb=look[1], rgbim=colors.copy(), compat=look[2])
    best = np.argmax(crf.inference(5), axis=0).reshape(labels.shape)
    found = known[best]
    return np.where((labels == 0) | (labels == NONE), labels, found)


def main():
    every = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    paths = sorted(Path(sys.argv[1]).glob("*.labels"))[::every]
    wrong = defaultdict(lambda: np.zeros(4, np.int64))
    seconds = defaultdict(float)
    for path in paths:
        labels, truth, ours, colors = read(path)
        kind = path.stem.rsplit(" ", 1)[0]
        near, thin = near_and_thin(truth)
        counted = (labels != 0) & (labels != NONE) & (truth != NONE)
        results = {"semantic": labels, "s3d": ours}
        for name, peer in PEERS.items():
            start = time.perf_counter()
            results[name] = refined(labels, colors, peer)
            seconds[kind, name] += time.perf_counter() - start
        for name, found in results.items():
            # A pixel whose label became none is wrong.
            is_wrong = found != truth
            parts = [(is_wrong & near), near, (is_wrong & thin), thin]
            wrong[kind, name] += [int((part & counted).sum()) for part in parts]

    for kind, name in wrong:
        near_wrong, near, thin_wrong, thin = wrong[kind, name]
        gone = 100 - 100 * near_wrong / wrong[kind, "semantic"][0]
        count = sum(path.stem.rsplit(" ", 1)[0] == kind for path in paths)
        print(
            f"{kind:40} {name:28} near {100 * near_wrong / near:5.2f} % ({gone:.0f} % gone)  "
            f"thin {100 * thin_wrong / max(thin, 1):5.2f} %  {1e3 * seconds[kind, name] / count:.0f} ms an image"
        )


if __name__ == "__main__":
    main()
