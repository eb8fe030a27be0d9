#!/usr/bin/env python3
"""How long does a textured OBJ of 300,000 faces take to load, here and with Open3D and trimesh?

    python3 bench/load_peers.py FOLDER [--faces 300000] [--runs 3]

Makes the mesh in FOLDER if it is not there yet (fixed seed: 12 materials, their textures JPEG and PNG from 1024² to
4096²), builds `s3d-io`'s example `load_mesh`, and times every reader in a process of its own, with one thread and with
two. Needs numpy, Pillow, open3d and trimesh; without one of the last two, that row is left out.

User time is the processors' time in the reader's own code, whatever else the machine does. Peak memory is the process's.
"""
import argparse, json, os, resource, statistics, subprocess, sys, time
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[1]
SIDES = [4096, 4096, 2048, 2048, 2048, 2048, 1024, 1024, 1024, 1024, 1024, 1024]


def texture(rng, side):
    """Something like a photograph: soft shapes, edges and a little noise."""
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) / side
    image = np.empty((side, side, 3), np.float32)
    for channel in range(3):
        a, b, c, d = rng.uniform(2, 25, 4)
        image[..., channel] = 128 + 60 * np.sin(a * x + b * y * y) + 30 * np.sign(np.sin(c * x) * np.sin(d * y))
    image += rng.normal(0, 4, (side, side, 1))
    return image.clip(0, 255).astype(np.uint8)


def generate(folder, faces):
    """A bumpy ground of squares, twelve strips of it with a material each, as scanners' software writes it."""
    from PIL import Image

    rng = np.random.default_rng(3)
    folder.mkdir(parents=True, exist_ok=True)
    library = []
    for i, side in enumerate(SIDES):
        name = f"texture_{i:02}." + ("png" if i % 3 == 2 else "jpg")
        Image.fromarray(texture(rng, side)).save(folder / name, **({} if i % 3 == 2 else {"quality": 92}))
        library.append(f"newmtl material_{i:02}\nKa 1 1 1\nKd 1 1 1\nillum 1\nmap_Kd {name}\n")
    (folder / "mesh.mtl").write_text("\n".join(library))
    n = int(round((faces / 2) ** 0.5))
    i, j = np.divmod(np.arange((n + 1) ** 2), n + 1)
    xyz = np.column_stack((i * 0.02, rng.normal(0, 0.005, i.size), j * 0.02))
    uv = np.column_stack((i / n * len(SIDES) % 1.0, j / n))
    normals = rng.normal(0, 0.1, (i.size, 3)) + [0, 1, 0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    with open(folder / "mesh.obj", "w") as out:
        out.write("mtllib mesh.mtl\n")
        out.writelines("v %.6f %.6f %.6f\n" % tuple(p) for p in xyz)
        out.writelines("vt %.6f %.6f\n" % tuple(p) for p in uv)
        out.writelines("vn %.4f %.4f %.4f\n" % tuple(p) for p in normals)
        corner = "{0}/{0}/{0}".format
        strip = -1
        for row in range(n):
            if row * len(SIDES) // n != strip:
                strip = row * len(SIDES) // n
                out.write(f"usemtl material_{strip:02}\n")
            for column in range(n):
                a = row * (n + 1) + column + 1
                a, b, c, d = corner(a), corner(a + 1), corner(a + n + 1), corner(a + n + 2)
                out.write(f"f {a} {b} {d}\nf {a} {d} {c}\n")


def open3d_legacy(path):
    import open3d

    start = clock()
    mesh = open3d.io.read_triangle_mesh(path, enable_post_processing=False)
    return start, len(mesh.triangles), len(mesh.textures)


def open3d_tensor(path):
    import open3d

    start = clock()
    mesh = open3d.t.io.read_triangle_mesh(path)
    # Holds one material.
    return start, len(mesh.triangle.indices), len(mesh.material.texture_maps)


def open3d_model(path):
    import open3d

    start = clock()
    model = open3d.io.read_triangle_model(path)
    return start, sum(len(m.mesh.triangles) for m in model.meshes), len(model.materials)


def of_trimesh(path):
    import trimesh

    start = clock()
    scene = trimesh.load(path, process=False)
    meshes = list(scene.geometry.values()) if hasattr(scene, "geometry") else [scene]
    # Images are decoded when they are asked for.
    for mesh in meshes:
        mesh.visual.material.image.load()
    return start, sum(len(m.faces) for m in meshes), len(meshes)


PEERS = {
    "open3d.io.read_triangle_mesh": open3d_legacy,
    "open3d.io.read_triangle_model": open3d_model,
    "open3d.t.io.read_triangle_mesh": open3d_tensor,
    "trimesh.load": of_trimesh,
}


def clock():
    return time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime


def child(name, path):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    (wall, user), faces, textures = PEERS[name](path)
    now = clock()
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    row = dict(wall=now[0] - wall, user=now[1] - user, faces=faces, textures=textures, mib=(after - before) / 1024)
    print("RESULT " + json.dumps(row))


def run(command, threads, runs):
    rows = []
    for _ in range(runs):
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "RAYON_NUM_THREADS": str(threads)}
        pinned = ["taskset", "-c", ",".join(map(str, sorted(os.sched_getaffinity(0))[:threads]))]
        done = subprocess.run(pinned + command, env=environment, capture_output=True, text=True)
        lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        if not lines:
            return None, (done.stderr.strip().splitlines() or ["no result"])[-1]
        rows.append(json.loads(lines[-1][7:]))
    return {key: statistics.median(row[key] for row in rows) for key in rows[0]}, ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--faces", type=int, default=300_000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--only-ours", action="store_true")
    parser.add_argument("--child", choices=PEERS)
    args = parser.parse_args()
    path = args.folder / "mesh.obj"
    if args.child:
        return child(args.child, str(path))
    if not path.exists():
        generate(args.folder, args.faces)
    cargo = ["cargo", "build", "--release", "--quiet", "-p", "s3d-io", "--example", "load_mesh"]
    subprocess.run(cargo, cwd=REPOSITORY, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    ours = [str(target / "release/examples/load_mesh"), str(path)]
    images = sum(p.stat().st_size for p in args.folder.glob("texture_*"))
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB of text, {images / 1e6:.1f} MB of images, {args.runs} runs each")
    commands = {"s3d-io": ours}
    if not args.only_ours:
        commands |= {name: [sys.executable, __file__, str(args.folder), "--child", name] for name in PEERS}
    for threads in (1, 2):
        print(f"\n{threads} thread{'s' * (threads > 1)}\n{'reader':32}{'wall s':>8}{'user s':>8}{'MiB':>7}  wall / ours  user / ours")
        base = None
        for name, command in commands.items():
            row, why = run(command, threads, args.runs)
            if row is None:
                print(f"{name:32} not run: {why}")
                continue
            base = base or row
            ratios = f"{row['wall'] / base['wall']:10.1f} ×{row['user'] / base['user']:11.1f} ×"
            print(f"{name:32}{row['wall']:8.2f}{row['user']:8.2f}{row['mib']:7.0f}{ratios}"
                  f"   ({row['faces']:.0f} faces, {row['textures']:.0f} textures)")


main()
