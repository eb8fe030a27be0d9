# %% [markdown]
# # Training on views that are rendered meanwhile
#
# A mesh shows more views than any folder of files holds. Here a small network learns classes from views that are made when
# it asks for them, anywhere in the rooms where a camera fits, and is tested on the data set's own views.

# %%
import subprocess
import sys
from pathlib import Path

import numpy as np
from sklearn.neural_network import MLPClassifier

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)
ds = s3d.open("s3d-demo")

# %% [markdown]
# ## A data set without files
#
# A sample depends on seed, epoch and index alone, whichever process makes it. `torch.utils.data.DataLoader` takes
# `rendered`, and `rendered.stream(rank, ranks)`, as they are.

# %%
rendered = s3d.RenderedViews(
    ds,
    size=(96, 96),
    modalities=["rgb", "normal", "depth", "xyz", "classes"],
    sampler="free_space",
    augment=s3d.Augment(exposure=0.3),
)
print(rendered)
shown = [s3d.Picture(np.asarray(rendered[index]["rgb"]).transpose(1, 2, 0)) for index in range(8)]
shown[0].beside(*shown[1:])

# %% [markdown]
# ## A small network
#
# It sees the colour of a pixel, how far it is, how high it lies and where its surface faces, and the means of these in two
# squares around it, a twelfth and a quarter of the image wide.


# %%
def means(image: np.ndarray, radius: int) -> np.ndarray:
    """Returns the means of an image (H, W, N) over squares around its pixels."""
    padded = np.pad(image, ((radius + 1, radius), (radius + 1, radius), (0, 0)), mode="edge").cumsum(0).cumsum(1)
    wide = 2 * radius + 1
    return (padded[wide:, wide:] - padded[wide:, :-wide] - padded[:-wide, wide:] + padded[:-wide, :-wide]) / wide**2


def columns(rgb: np.ndarray, normal: np.ndarray, depth: np.ndarray, z: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Returns a row for each pixel. Images are (H, W) or (H, W, 3)."""
    upwards = normal @ pose[2, :3]
    parts = [rgb / 255.0, depth[..., None] / 5.0, z[..., None] / 3.0, upwards[..., None]]
    image = np.nan_to_num(np.concatenate(parts, axis=-1))
    around = [means(image, image.shape[1] // share) for share in (24, 8)]
    return np.concatenate([image, *around], axis=-1).reshape(-1, 18)


def of_sample(sample: dict) -> tuple[np.ndarray, np.ndarray]:
    """Returns the rows and the classes of the pixels that have one."""
    rgb, normal, xyz = (np.asarray(sample[word]).transpose(1, 2, 0) for word in ("rgb", "normal", "xyz"))
    rows = columns(rgb, normal, np.asarray(sample["depth"]), xyz[..., 2], np.asarray(sample["T_world_cam"]))
    classes = np.asarray(sample["classes"]).ravel()
    return rows[classes >= 0], classes[classes >= 0]


def of_view(view: s3d.View) -> tuple[np.ndarray, np.ndarray]:
    """Returns the same of a view of the data set, on every fourth pixel of every fourth row."""
    rows = columns(view.rgb, view.normal, view.depth, view.points()[..., 2], view.T_world_cam)
    classes = view.classes.astype(int)
    every = np.zeros(classes.shape, bool)
    every[::4, ::4] = True
    kept = (every & (classes >= 0)).ravel()
    return rows[kept], classes.ravel()[kept]


tests = [of_view(view) for view in ds.views()[::3]]
test_rows, test_classes = (np.concatenate(parts) for parts in zip(*tests))
names = ds.classes or []
network = MLPClassifier(hidden_layer_sizes=(96, 48), learning_rate_init=0.003, random_state=0)
stream = iter(rendered.stream())
told = []
for step in range(1, 151):
    # A step learns from pixels of ten views at once.
    rows, classes = (np.concatenate(parts) for parts in zip(*(of_sample(next(stream)) for _ in range(10))))
    some = np.random.default_rng(step).permutation(len(rows))[:6000]
    network.partial_fit(rows[some], classes[some], classes=np.arange(len(names)))
    if step in (1, 5, 20, 60, 150):
        right = network.predict(test_rows) == test_classes
        told.append(right.mean())
        print(f"after {10 * step:4} views: {right.mean():.1%} of the pixels of the data set's views are right")

most = np.bincount(test_classes).max() / len(test_classes)
print(f"always the commonest class: {most:.1%}")
assert told[-1] > told[0] and told[-1] > most + 0.1

# %% [markdown]
# ## What it sees

# %%
view = max(ds.views(), key=lambda view: len(view.shares))
guessed = network.predict(
    columns(view.rgb, view.normal, view.depth, view.points()[..., 2], view.T_world_cam)
).reshape(view.classes.shape)
colors = np.asarray(ds.class_colors)
view.picture().beside(s3d.Picture(colors[guessed]), view.picture("classes"))
