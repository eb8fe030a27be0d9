# %% [markdown]
# # Predictions scored
#
# Each protocol is used by published code, and gives the same digits as that code. A prediction has a file for each image or room.

# %%
import subprocess
import sys
from pathlib import Path

import numpy as np

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)
ds = s3d.open("s3d-demo")

# %% [markdown]
# ## Depth of panoramas
#
# A prediction that is wrong by 5 % and some noise: a NumPy file for each panorama, in metres.

# %%
random = np.random.default_rng(0)
Path("depth").mkdir(exist_ok=True)
by_hand = []
for view in ds.panoramas():
    noise = 1.05 + 0.02 * random.standard_normal(view.depth.shape)
    predicted = np.nan_to_num(view.depth * noise).astype(np.float32)
    np.save(f"depth/{view.name}.npy", predicted)
    seen = np.nan_to_num(view.depth) > 0
    truth, guess = np.clip(view.depth[seen], 0.01, 10), np.clip(predicted[seen], 0.01, 10)
    by_hand.append(np.mean(np.abs(truth - guess) / truth))
scores = ds.evaluate("depth", "depth", bootstrap=200)
print(scores)

# %% [markdown]
# The mean over panoramas of |d − d̂| / d, computed by hand, is the same if the data set's panoramas have the protocol's size,
# 1024 × 512.

# %%
AbsRel = scores.score("mean", "AbsRel")
print(f"AbsRel {AbsRel:.5f}, by hand {np.mean(by_hand):.5f}")
assert abs(AbsRel - np.mean(by_hand)) < 1e-5

# %% [markdown]
# ## Normals of views
#
# The prediction is turned by ten degrees about the camera's x axis. A normal across the axis is wrong by ten degrees, any
# other by less.

# %%
Path("normal").mkdir(exist_ok=True)
c, s = np.cos(np.radians(10)), np.sin(np.radians(10))
turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
for view in ds.views():
    # Files have the data set's axes: x right, y down, z towards the camera.
    stored = view.normal * [1, 1, -1] @ turn.T
    np.save(f"normal/{view.name}.npy", np.nan_to_num(stored).astype(np.float32))
scores = ds.evaluate("normal", "normal", images="views")
print(scores)
mean = scores.score("all pixels", "mean (°)")
assert 1 < mean < 10.5

# %% [markdown]
# ## Boxes
#
# The boxes of the annotated points score 1 against themselves. Moved by ten centimetres along each axis, thin boxes
# no longer overlap by half. Without `boxes="annotations"` the truth is the boxes of the sampled points, which
# detectors are given.

# %%
for moved in (0.0, 0.1):
    boxes = [
        s3d.FoundBox(
            area,
            instance.room,
            instance.class_name,
            1.0,
            tuple(np.add(instance.bounds[:3], moved)),
            tuple(np.add(instance.bounds[3:], moved)),
        )
        for area in ds.areas
        for instance in ds.instances(area)
    ]
    s3d.save_boxes("boxes.json", boxes)
    scores = ds.evaluate("det", "boxes.json", boxes="annotations")
    AP = scores.score("mean", "AP@0.50")
    print(f"moved by {moved} m: AP@0.50 {AP:.3f}")
    assert AP == 1.0 if moved == 0 else AP < 0.7
