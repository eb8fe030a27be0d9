# %% [markdown]
# # A tiny segmentation
#
# Classes of pixels from colour, distance, normal and height, learnt from some panoramas and tested on the others. It needs
# scikit-learn and Pillow. A score on the built-in scene tests a program; it says nothing about real rooms.

# %%
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from sklearn.ensemble import RandomForestClassifier

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)
ds = s3d.open("s3d-demo")
panoramas = ds.panoramas()
print(panoramas, ds.classes)


# %% [markdown]
# ## The features of a pixel
#
# All modalities are registered, so a pixel's features belong to one place on one surface.


# %%
def features(view: s3d.View) -> np.ndarray:
    """(H × W, 9): colour, distance, normal, height above the camera and elevation of the ray."""
    height = view.points()[..., 2] - view.T_world_cam[2, 3]
    columns = [view.rgb, view.depth, view.normal, height, height / view.depth]
    return np.concatenate([np.atleast_3d(column) for column in columns], -1).reshape(-1, 9)


# %% [markdown]
# ## Two folds
#
# Rooms with even numbers and rooms with odd numbers are two folds: no panorama is predicted by a model that saw one of its
# room. (Through open doors it may have seen a part of it.)

# %%
rooms = sorted({view.room for view in panoramas})
fold_of = {room: number % 2 for number, room in enumerate(rooms)}
random = np.random.default_rng(0)
Path("classes").mkdir(exist_ok=True)
for fold in (0, 1):
    x, y = [], []
    for view in panoramas:
        if fold_of[view.room] != fold:
            labelled = np.flatnonzero(view.classes.reshape(-1) >= 0)
            some = random.choice(labelled, min(4000, len(labelled)), replace=False)
            x.append(features(view)[some])
            y.append(view.classes.reshape(-1)[some])
    model = RandomForestClassifier(12, max_depth=16, min_samples_leaf=5, random_state=0)
    model.fit(np.concatenate(x), np.concatenate(y))
    for view in panoramas:
        if fold_of[view.room] == fold:
            found = model.predict(features(view)).reshape(view.classes.shape)
            Image.fromarray(found.astype(np.uint8)).save(f"classes/{view.name}.png")

# %% [markdown]
# ## The score
#
# By HoHoNet's definition, with an interval by drawing panoramas again.

# %%
scores = ds.evaluate("sem-pano", "classes", bootstrap=200)
print(scores)
Path(f"classes/{panoramas[0].name}.png").rename("learnt.png")
learnt = scores.score("mean", "IoU")
for view in panoramas:
    Image.fromarray(np.full(view.classes.shape, (ds.classes or []).index("wall"), np.uint8)).save(f"classes/{view.name}.png")
guessed = ds.evaluate("sem-pano", "classes").score("mean", "IoU")
print(f"mean IoU: learnt {learnt:.3f}, all wall {guessed:.3f}")
assert learnt > 3 * guessed

# %% [markdown]
# A panorama, its classes, and what was learnt in other rooms.

# %%
view = panoramas[0]
found = Image.open("learnt.png")
colors = np.asarray(ds.class_colors)
rows = [view.rgb, view.picture("classes").pixels, colors[np.asarray(found)]]
s3d.Picture(np.vstack([row[row.shape[0] // 4 : -row.shape[0] // 4] for row in rows]))

# %% [markdown]
# ## With torch
#
# The same images for a network of your own: `ignore_index=-1` leaves out unlabelled pixels.
#
# ```python
# train = ds.views().torch(["rgb", "depth", "classes"])
# loader = torch.utils.data.DataLoader(train, batch_size=8, shuffle=True, num_workers=8)
# loss = torch.nn.CrossEntropyLoss(ignore_index=-1)
# ```
