"""Makes a scan that `s3d export` reads of the synthetic office of the peers.

    python3 bench/office_scene.py OFFICE [OUT]

OFFICE is the folder that gen_scene.py wrote (scene.obj with texture.png, scene.bin, scene.uv.bin, scene.json). Writes
scene.toml, cameras.csv and the S3DIS tree Area_1 into OUT (OFFICE if not given): each object of scene.json is an
instance, sampled uniformly with 2,500 points a square metre and coloured by the texture; one location. Needs numpy and
Pillow.
"""

import argparse
import json
import os
from pathlib import Path

import numpy as np
from PIL import Image

POINTS_PER_M2 = 2500
LOCATION = (4.03, 3.07, 1.5)
UUID = "00000000000000000000000000000001"


def read_scene(folder):
    data = (folder / "scene.bin").read_bytes()
    if data[:4] != b"SCN1":
        raise SystemExit(f"{folder / 'scene.bin'}: not a file of gen_scene.py")
    vertices, faces = np.frombuffer(data, "<u4", 2, 4)
    at = 12
    positions = np.frombuffer(data, "<f4", 3 * vertices, at).reshape(-1, 3).astype(float)
    at += 12 * int(vertices)
    indices = np.frombuffer(data, "<u4", 3 * faces, at).reshape(-1, 3)
    at += 12 * int(faces)
    return positions, indices, np.frombuffer(data, "<u4", faces, at)


def sample(corners, uvs, texture, rng):
    """Uniform points on triangles, and their colours."""
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    face = rng.choice(len(areas), max(1, round(areas.sum() * POINTS_PER_M2)), p=areas / areas.sum())
    r, s = np.sqrt(rng.random(len(face))), rng.random(len(face))
    weights = np.stack([1 - r, r * (1 - s), r * s], 1)
    points = np.einsum("ij,ijk->ik", weights, corners[face])
    u, v = np.einsum("ij,ijk->ki", weights, uvs[face])
    height, width = texture.shape[:2]
    column = np.clip((u * width).astype(int), 0, width - 1)
    row = np.clip(((1 - v) * height).astype(int), 0, height - 1)
    return points, texture[row, column]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("office", type=Path)
    parser.add_argument("out", type=Path, nargs="?")
    args = parser.parse_args()
    out = args.out or args.office
    positions, faces, objects = read_scene(args.office)
    uvs = np.fromfile(args.office / "scene.uv.bin", "<f4").reshape(-1, 2).astype(float)
    texture = np.asarray(Image.open(args.office / "texture.png").convert("RGB"))
    names = json.loads((args.office / "scene.json").read_text())["names"]

    rng = np.random.default_rng(1)
    rooms = {}
    for k, name in enumerate(names):
        class_name, number, room_type, room_number = name.split("_")
        room = out / "Area_1" / f"{room_type}_{room_number}"
        (room / "Annotations").mkdir(parents=True, exist_ok=True)
        of_object = faces[objects == k]
        points, colors = sample(positions[of_object], uvs[of_object], texture, rng)
        lines = "".join("%.3f %.3f %.3f %d %d %d\n" % (*p, *c) for p, c in zip(points, colors))
        (room / "Annotations" / f"{class_name}_{number}.txt").write_text(lines)
        rooms.setdefault(room, []).append(lines)
    for room, parts in rooms.items():
        (room / f"{room.name}.txt").write_text("".join(parts))
    (out / "cameras.csv").write_text("%s,%.6f,%.6f,%.6f,0,0,0,1\n" % (UUID, *LOCATION))
    mesh = Path(os.path.relpath(args.office / "scene.obj", out)).as_posix()
    (out / "scene.toml").write_text(
        f'area = 1\n\n[mesh]\npath = "{mesh}"\nup = "z"\n\n[annotations]\npath = "Area_1"\n\n[cameras]\npath = "cameras.csv"\n'
    )
    print(f"{out / 'scene.toml'}: {len(faces)} faces, {len(names)} instances in {len(rooms)} room(s)")


if __name__ == "__main__":
    main()
