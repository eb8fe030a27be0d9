# %% [markdown]
# # From a scan to a data set
#
# A mesh alone is enough: scan locations are placed, images rendered, and what labels there are carried over. The scan
# here is that of the built-in scene; put the path of your own in its place.

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
# What is wrong with a scan is told before hours go into it: `info` has its size, its rooms' height, and what looks
# wrong; `warnings` what had to be mended.

# %%
scan = "s3d-demo/scan/rgb.obj"
print(s3d.info(scan))
mesh = s3d.read_mesh(scan, up="y")
print(mesh, *mesh.warnings, sep="\n")

# %% [markdown]
# ## Where to look from
#
# As few places as see 90 % of the surface, each where a tripod could stand. The first sees the most.

# %%
scene = s3d.Scene(mesh)
places = scene.place_cameras(see=0.9)
print(len(places), "scan locations, the first:", places[0])
panorama = scene.panorama(places[0], width=1024, rgb_samples=4)
Path("panorama.png").write_bytes(panorama._repr_png_())
panorama

# %% [markdown]
# ## Labels
#
# Without labels the data set has everything else. Annotated points of the scan, in any format that `read_points` knows,
# vote for the label of each face; faces that no point is near take that of the surface beside them.

# %%
points = s3d.read_points("s3d-demo/scan/Area_1")
votes = s3d.vote(mesh, points, points.label)
labels = (points.names, votes.filled(within=0.1))
print(points, votes, sep="\n")

# %% [markdown]
# ## The data set
#
# An export that is stopped goes on when this is called again. Leave `size`, `views` and `pano_width` out for the paper's.

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
view
