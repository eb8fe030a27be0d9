"""Draws the meshes of `scenes.py` side by side, as one picture a scene and device.

    python3 bench/fusion/pictures.py OUT -o docs/images

Needs numpy and open3d. OUT is the folder of `scenes.py`. Each mesh is seen from the same place, lit from there, in
grey, so that noise and holes are seen; what is seen from behind is red, and nothing is white.
"""

import argparse
from pathlib import Path

import numpy as np
import open3d as o3d

METHODS = ["s3d", "scalable", "blocks", "poisson10"]
SIZE = (420, 320)

# The eye, what it looks at, and half of the picture's width at a distance of one.
VIEWS = {
    "office-tum": ((14.6, 8.9, 1.7), (11.0, 6.6, 0.7), 0.6),
    "office-ptx": ((14.6, 8.9, 1.7), (11.0, 6.6, 0.7), 0.6),
}


def drawn(mesh, eye, target, half):
    """The picture of a mesh: height × width × 3."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    eye, target = np.array(eye), np.array(target)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)

    # Four rays a pixel.
    width, height = (2 * side for side in SIZE)
    y, x = np.mgrid[0:height, 0:width]
    x, y = ((2 * x + 1) / width - 1) * half, (1 - (2 * y + 1) / height) * half * height / width
    rays = forward + x[..., None] * right + y[..., None] * up
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    origins = np.broadcast_to(eye, rays.shape)
    hits = scene.cast_rays(o3d.core.Tensor(np.concatenate([origins, rays], -1).astype(np.float32)))

    facing = -(hits["primitive_normals"].numpy() * rays).sum(-1)
    picture = np.repeat((40 + 200 * np.abs(facing))[..., None], 3, -1)
    picture[facing < 0] *= (1, 0.4, 0.4)
    picture[np.isinf(hits["t_hit"].numpy())] = 255
    return picture.reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3))


def main():
    text = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=text)
    parser.add_argument("out", type=Path)
    parser.add_argument("-o", "--pictures", type=Path, required=True)
    args = parser.parse_args()
    for name, view in VIEWS.items():
        meshes = [o3d.io.read_triangle_mesh(str(args.out / name / f"{method}.ply")) for method in METHODS]
        row = np.hstack([drawn(mesh, *view) for mesh in meshes])
        file = args.pictures / f"fusion-{name}.jpg"
        o3d.io.write_image(str(file), o3d.geometry.Image(row.round().astype(np.uint8)), quality=85)
        print(file)


if __name__ == "__main__":
    main()
