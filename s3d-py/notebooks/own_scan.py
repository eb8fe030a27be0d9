# %% [markdown]
# # From a scan to a data set
#
# A mesh alone is enough: scan locations are placed, images are rendered, and labels are carried over if there are any. The
# scan here is the built-in scene; put the path of your own scan in its place.

# %%
import subprocess
import sys
from pathlib import Path

import s3d_py as s3d

if not Path("s3d-demo").exists():
    small = ["--views", "24", "--size", "320", "--pano-width", "1024"]
    subprocess.run([sys.executable, "-m", "s3d_py", "demo", "-o", "s3d-demo", *small], check=True)

# %% [markdown]
# ## The mesh
#
# Look for faults in a scan before you spend hours on it: `info` has its size, the height of its rooms, and anything that
# looks wrong; `warnings` lists the repairs.

# %%
scan = "s3d-demo/scan/rgb.obj"
print(s3d.info(scan))
mesh = s3d.read_mesh(scan)
print(mesh, *mesh.warnings, sep="\n")

# %% [markdown]
# ## Where to look from
#
# As few places as possible see 90 % of the surface, each where a tripod could stand. The first sees the most.

# %%
scene = s3d.Scene(mesh)
places = scene.place_cameras(see=0.9)
print(len(places), "scan locations, the first:", places[0])
panorama = scene.panorama(places[0], width=1024, rgb_samples=4)
Path("panorama.png").write_bytes(panorama._repr_png_())
panorama

# %% [markdown]
# ## What somebody sees who walks through
#
# A walk of half a minute, and every eighth second of it. `s3d render --trajectory 30 --video` makes a video of the same walk.

# %%
cameras = s3d.walk(scene, 900)
stops = scene.render_many([c.T_world_cam for c in cameras[::240]], s3d.intrinsics((320, 240), 75), (320, 240))
first, *others = [s3d.Picture(stop.rgb) for stop in stops]
first.beside(*others)

# %% [markdown]
# ## Labels
#
# Without labels the data set has everything else. Annotated points of the scan, in any format that `read_points` knows,
# vote for the label of each face. Faces without a vote take the label of the surface beside them.

# %%
points = s3d.read_points("s3d-demo/scan/Area_1")
votes = s3d.vote(mesh, points, points.label)
labels = (points.names, votes.filled(within=0.1))
print(points, votes, sep="\n")

# %% [markdown]
# ## The data set
#
# A stopped export goes on when this is called again. Without `size`, `views` and `pano_width`, it has the paper's values.

# %%
s3d.export(mesh, "own", locations=places[:4], labels=labels, views=8, size=256, pano_width=1024, progress=True)
ds = s3d.open("own")
print(ds)
print("verified:", ds.verify().ok)
assert ds.verify().ok and len(ds.panoramas()) == 4 and {"chair", "wall"} <= set(ds.classes or [])

# %% [markdown]
# ## To look at
#
# A page that a browser opens from the disk: panoramas, the mesh, the plan, the paper's tables.

# %%
page = ds.report("own_page", overwrite=True)
print("open", page)
view = max(ds.views(), key=lambda view: len(view.shares))
print(view, view.shares)
view.picture().beside(view.picture("depth"), view.picture("normal"), view.picture().under(view.picture("classes")))
