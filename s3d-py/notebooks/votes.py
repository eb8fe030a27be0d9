# %% [markdown]
# # From labelled points to labelled faces
#
# Each annotated point votes for the face nearest to it; a face has the label with the most votes. This notebook shows how
# sure the votes are, and what happens where points are sparse.

# %%
import subprocess
import sys
from pathlib import Path

import numpy as np

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)
mesh = s3d.read_mesh("s3d-demo/scan/rgb.obj")
points = s3d.read_points("s3d-demo/scan/Area_1")
print(mesh, points, sep="\n")

# %% [markdown]
# ## The vote

# %%
votes = s3d.vote(mesh, points, points.label)
area = mesh.face_areas
labelled = votes.label >= 0
print(votes)
print(f"{area[labelled].sum() / area.sum():.1%} of the surface has a label")
disputed = labelled & (votes.share < 0.75)
print(f"{disputed.sum()} faces, {area[disputed].sum():.2f} m², are won by less than three quarters of their votes")

# %% [markdown]
# Between which labels?

# %%
pairs = np.stack([votes.label, votes.runner_up])[:, disputed & (votes.runner_up >= 0)]
(first, second), count = np.unique(np.sort(pairs, 0), axis=1, return_counts=True)
for place in np.argsort(-count)[:5]:
    print(f"{count[place]:5} faces: {points.names[first[place]]} or {points.names[second[place]]}")

# %% [markdown]
# ## Seen in an image
#
# The image of faces turns columns of faces into images: here red where points voted for several labels.

# %%
scene = s3d.Scene(mesh)
place = scene.place_cameras(see=0.5)[0]
image = scene.panorama(place, width=1024, modalities=["rgb", "face"])
of_face = np.where(labelled, votes.share, 1.0)
shown = np.where(image.face >= 0, of_face[image.face], 1.0)
print(f"a pixel's face was won by {shown.mean():.1%} of its votes on average")
doubt = np.sqrt(1 - shown)[..., None]
s3d.Picture((image.rgb * (1 - doubt) + np.array([230, 30, 30]) * doubt).astype(np.uint8))

# %% [markdown]
# ## Fewer points
#
# With one point in 200 of the scan, some faces have no vote. `filled` gives them the label of the surface beside them, up to
# the given distance and not around an edge.

# %%
thin = np.random.default_rng(0).random(len(points)) < 1 / 200
sparse = s3d.vote(mesh, points.xyz[thin], points.label[thin])


def told(label: np.ndarray) -> tuple[float, float]:
    """Returns the labelled share of the surface that all points label, and the share of it with the same label."""
    both = labelled & (label >= 0)
    return area[both].sum() / area[labelled].sum(), area[both & (label == votes.label)].sum() / area[both].sum()


for within in (0.0, 0.1, 0.3, 1.0):
    label = sparse.filled(within) if within else sparse.label
    covered, right = told(label)
    print(f"filled within {within} m: {covered:.1%} of the surface labelled, {right:.1%} of it right")
before, after = told(sparse.label), told(sparse.filled(0.3))
assert after[0] > before[0] and after[1] > 0.9

# %% [markdown]
# The labels of few points, and what `filled` makes of them, over the same picture. Each object has a colour of its own.

# %%
colors = np.random.default_rng(3).integers(40, 256, (len(points.names), 3)).astype(np.uint8)


def shown_over(label: np.ndarray) -> s3d.Picture:
    """Returns the panorama with the labels of its faces; what has none stays as it is."""
    of_pixel = np.where(image.face >= 0, label[image.face], -1)
    return image.picture().under(s3d.Picture(np.where(of_pixel[..., None] < 0, 0, colors[of_pixel])), 0.6)


s3d.Picture(np.vstack([shown_over(sparse.label).pixels, shown_over(sparse.filled(0.3)).pixels]))
