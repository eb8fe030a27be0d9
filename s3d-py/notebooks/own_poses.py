# %% [markdown]
# # Own poses, a training set
#
# Cameras of your own, such as those of a phone or of a robot, become images with exact depth and labels. The result is a
# folder that nerfstudio reads, with an array of classes beside each picture.

# %%
import subprocess
import sys
from pathlib import Path

import numpy as np

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)
scene = s3d.Scene("s3d-demo/scan/rgb.obj")

# %% [markdown]
# ## The cameras
#
# `read_poses` takes transforms.json, COLMAP, TUM and others. The list here is that of a walk through the building, two
# pictures a second, as a file that any of these programs could have written.

# %%
size = (320, 240)
K = s3d.intrinsics(size, 75)
walk = s3d.walk(scene, 120, rate=2.0)
s3d.save_poses("walk.json", [s3d.CameraPose(f"{i:04}", c.T_world_cam, K, size) for i, c in enumerate(walk)])
cameras = s3d.read_poses("walk.json")
print(len(cameras), "cameras, the first:", cameras[0].name, cameras[0].T_world_cam[:3, 3].round(2))

# %% [markdown]
# ## Labels
#
# Annotated points vote for faces, and a face has a class. What a pixel shows is known by its face.

# %%
points = s3d.read_points("s3d-demo/scan/Area_1")
votes = s3d.vote(scene.mesh, points, points.label)
classes = sorted({name.split("_")[0] for name in points.names})
class_of_label = np.array([classes.index(name.split("_")[0]) for name in points.names] + [-1])
class_of_face = class_of_label[votes.filled(within=0.1)]
print(classes)

# %% [markdown]
# ## The pictures

# %%
folder = Path("set")
for kind in ("images", "depth", "classes"):
    (folder / kind).mkdir(parents=True, exist_ok=True)
poses = [camera.T_world_cam for camera in cameras]
shares = np.zeros(len(classes))
kept = []
for camera, seen in zip(cameras, scene.render_many(poses, K, size, modalities=["rgb", "depth", "face"], rgb_samples=4)):
    shown = np.where(seen.face >= 0, class_of_face[seen.face], -1)
    s3d.Picture(seen.rgb).save(folder / "images" / f"{camera.name}.png")
    np.save(folder / "depth" / camera.name, seen.depth)
    np.save(folder / "classes" / camera.name, shown.astype(np.int8))
    shares += np.bincount(shown[shown >= 0], minlength=len(classes)) / shown.size / len(cameras)
    kept.append(s3d.CameraPose(f"images/{camera.name}.png", camera.T_world_cam, K, size))
s3d.save_poses(folder / "transforms.json", kept)
print({name: f"{share:.1%}" for name, share in zip(classes, shares)})
assert len(list((folder / "images").iterdir())) == 120 and shares.sum() > 0.95

# %% [markdown]
# ## To look at
#
# Picture, depth and classes of four of them.

# %%
colors = np.random.default_rng(5).integers(60, 256, (len(classes), 3)).astype(np.uint8)
columns = []
for pose in kept[10::32]:
    seen = scene.render(K, pose.T_world_cam, size, modalities=["rgb", "depth"])
    shown = np.load(folder / "classes" / f"{Path(pose.name).stem}.npy").astype(int)
    painted = s3d.Picture(np.where(shown[..., None] < 0, 0, colors[shown]))
    columns.append(np.vstack([p.pixels for p in (seen.picture(), seen.picture("depth"), seen.picture().under(painted, 0.6))]))
s3d.Picture(np.hstack(columns))

# %% [markdown]
# ## Without its neighbours
#
# Pictures of a walk that follow each other are almost the same. For a test, leave out a stretch of the walk, and not every
# tenth picture of it.

# %%
train, test = kept[:96], kept[100:]
gap = np.linalg.norm(train[-1].T_world_cam[:3, 3] - test[0].T_world_cam[:3, 3])
print(f"{len(train)} to train on, {len(test)} to test on, {gap:.1f} m apart")
