"""Pairs of images that see the same surface."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Pairs:
    """The images of an area that see the same surface: a sparse matrix of N × N images in rows, of M pairs. Both
    images of a pair have it. `s3d pairs` writes them; docs/formats.md defines the numbers.
    """

    images: list[str]
    """(N) names: "data/camera_…" of a view, "pano/camera_…" of a panorama, as in `View.path`, without the
    modality."""
    start: npt.NDArray[np.uint64]
    """(N + 1,): the pairs of image i are those from `start[i]` to `start[i + 1]`."""
    other: npt.NDArray[np.uint32]
    """(M,), the place of the other image."""
    overlap: npt.NDArray[np.float32]
    """(M,), the share of image i's points that the other image sees, too."""
    angle_deg: npt.NDArray[np.float32]
    """(M,), the median angle at those points between the directions to both cameras. NaN without such points."""
    scale: npt.NDArray[np.float32]
    """(M,), the median size of a pixel there in image i by that in the other one. NaN without such points."""
    distance_m: npt.NDArray[np.float32]
    """(M,), the distance between both cameras."""
    turn_deg: npt.NDArray[np.float32]
    """(M,), the angle of the rotation from one camera to the other."""

    def of(self, image: int) -> npt.NDArray[np.intp]:
        """Returns the places in the arrays of an image's pairs, the largest overlap first."""
        pairs = np.arange(int(self.start[image]), int(self.start[image + 1]))
        return pairs[np.argsort(-self.overlap[pairs], kind="stable")]

    def matrix(self) -> npt.NDArray[np.float32]:
        """Returns the overlaps as a whole matrix (N, N), as MapAnything's `pairwise_covisibility` has them: 0 for
        images without a pair, 1 on the diagonal.
        """
        whole = np.eye(len(self.images), dtype=np.float32)
        start = self.start.astype(np.int64)
        rows = np.repeat(np.arange(len(self.images)), start[1:] - start[:-1])
        whole[rows, self.other] = self.overlap
        return whole

    def groups(self, size: int, *, min_overlap: float = 0.2) -> list[list[int]]:
        """Returns groups of `size` images that share a place, one for each image that has enough others. A group
        begins with the image. Then comes, again and again, the image whose overlaps with those of the group are
        the largest in their mean; it shares at least `min_overlap` with one of them. Of both overlaps of a pair
        the larger one counts. Memory: N × N.
        """
        whole = self.matrix()
        shared = np.maximum(whole, whole.T)
        groups = []
        for first in range(len(self.images)):
            group = [first]
            while len(group) < size:
                near = shared[group].max(axis=0) >= min_overlap
                near[group] = False
                if not near.any():
                    break
                group.append(int(np.argmax(np.where(near, shared[group].mean(axis=0), -1))))
            if len(group) == size:
                groups.append(group)
        return groups


@dataclass(frozen=True)
class Correspondences:
    """N places of a surface that two images show, by exact rays."""

    pixels: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
    """Two arrays (N, 2), one an image: x to the right and y down in pixels, the centre of the first pixel at
    (0.5, 0.5). Those of the first image are centres of pixels, each once."""
    xyz: npt.NDArray[np.float64]
    """(N, 3), world metres."""
    face: npt.NDArray[np.int32]
    """(N,), index of the face of `DataSet.mesh`."""
    label: npt.NDArray[np.int32] | None
    """(N,), index into `DataSet.labels`, 0 without a label; None if the data set has no labels."""

    def __len__(self) -> int:
        return len(self.face)


def read_pairs(path: Path) -> Pairs:
    """Reads `pairs.npz`."""
    with np.load(path) as arrays:
        columns = {name: arrays[name] for name in arrays.files if name != "images"}
        return Pairs(images=arrays["images"].tolist(), **columns)
