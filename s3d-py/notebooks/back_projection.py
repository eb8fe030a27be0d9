# %% [markdown]
# # Pixels to points, and to other pixels
#
# Every modality of an image shows the same hit of a ray, so depth and pose give the world position of each pixel.

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
# ## A view
#
# Depth is along the optical axis, so that $X = T\,(z\,K^{-1}(u, v, 1)^T)$; the centre of the first pixel is at (0.5, 0.5).
# `View.points` does the same.

# %%
view = ds.views()[0]
width, height = view.size
u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(view.K).T
camera = rays * view.depth[..., None]
world = camera @ view.T_world_cam[:3, :3].T + view.T_world_cam[:3, 3]
print("largest difference to View.points:", np.nanmax(np.abs(world - view.points())), "m")
assert np.nanmax(np.abs(world - view.points())) < 1e-4
view.picture().beside(view.picture("depth"), view.picture("normal"))

# %% [markdown]
# ## A cloud of all images of a room
#
# Depth of panoramas is the distance along the ray, which `points` takes into account. The cloud is a PLY file for any viewer.

# %%
room = view.room
images = [*ds.panoramas(room=room), *ds.views(room=room)]
xyz = np.concatenate([image.points().reshape(-1, 3) for image in images])
rgb = np.concatenate([image.rgb.reshape(-1, 3) for image in images])
seen = np.isfinite(xyz).all(1)
s3d.save_points("room.ply", xyz[seen], rgb[seen])
print(f"{seen.sum():,} points of {len(images)} images in room.ply")

# %% [markdown]
# The room from above: points whose label is of the room, without what is higher than two metres. Each pixel of the plan,
# 1.5 cm wide, has the colour of the highest point in it.

# %%
labels = np.concatenate([image.labels.reshape(-1) for image in images])
is_of_room = np.array([False] + [label.room == room for label in ds.labels[1:]])
kept = seen & (labels > 0) & is_of_room[labels]
kept &= xyz[:, 2] < np.nanmin(xyz[kept, 2]) + 2.0
from_below = np.flatnonzero(kept)[np.argsort(xyz[kept, 2])]
column, row = ((xyz[from_below, :2] - xyz[from_below, :2].min(axis=0)) / 0.015).astype(int).T
plan = np.zeros((row.max() + 1, column.max() + 1, 3), np.uint8)
plan[row.max() - row, column] = rgb[from_below]
s3d.Picture(plan)

# %% [markdown]
# The points lie on the mesh: a ray from the camera through each point meets the mesh there, within the step of the depth
# images (1/512 m).

# %%
scene = ds.scene()
eye = view.T_world_cam[:3, 3]
points = view.points().reshape(-1, 3)[::97].astype(np.float64)
points = points[np.isfinite(points).all(1)]
hits = scene.cast(eye, points - eye)
off = np.abs(hits.t - 1) * np.linalg.norm(points - eye, axis=1)
print(f"median {np.nanmedian(off) * 1000:.2f} mm from the mesh along the ray, 99 % within {np.nanpercentile(off, 99) * 1000:.1f} mm")
assert np.nanmedian(off) < 0.002

# %% [markdown]
# ## One image seen from another
#
# Points of one view are projected into another of the same scan location. Where the other's depth agrees, both see the
# same surface, and colours and labels must be the same.

# %%
T_cam_world = np.linalg.inv(view.T_world_cam)
rows = []
best: dict[str, np.ndarray] = {}
for other in ds.views(location=view.location):
    if other.index == view.index:
        continue
    in_camera = other.points().reshape(-1, 3) @ T_cam_world[:3, :3].T + T_cam_world[:3, 3]
    with np.errstate(invalid="ignore", divide="ignore"):
        pixel = in_camera @ view.K.T / in_camera[:, 2:]
        inside = (in_camera[:, 2] > 0.05) & (pixel[:, 0] >= 0) & (pixel[:, 0] < width) & (pixel[:, 1] >= 0) & (pixel[:, 1] < height)
    column, row = pixel[inside, 0].astype(int), pixel[inside, 1].astype(int)
    same = np.abs(view.depth[row, column] - in_camera[inside, 2]) < 0.02
    label = other.labels.reshape(-1)[inside]
    rows.append((other.name, int(same.sum()), int((view.labels[row, column] == label)[same].sum())))
    best[other.name] = np.zeros_like(view.rgb)
    best[other.name][row[same], column[same]] = other.rgb.reshape(-1, 3)[inside][same]
name, shared, agreeing = max(rows, key=lambda row: row[1])
print(f"{name} shares {shared:,} pixels, of which {agreeing / shared:.1%} have the same label")
assert shared > 1000 and agreeing / shared > 0.97

# %% [markdown]
# The view, and what the other view shows of it: its colours, moved to where their points are seen from here.

# %%
view.picture().beside(s3d.Picture(best[name]))
