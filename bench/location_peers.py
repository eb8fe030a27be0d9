"""One scan location, everything rendered and written: Open3D + numpy + OpenCV + OpenEXR against `s3d export`.

    cargo build --release -p s3d-cli
    python3 bench/location_peers.py SCENE.toml… [--rounds N] [--scratch DIR]

Needs Linux, numpy, open3d, opencv-python-headless and OpenEXR. Each scene's first location is exported alone.

Ours: user time of the whole process with all images, less that of the same process with `--views 0 --modalities pose`,
which reads, labels and samples but renders nothing: 72 candidates scored, about 52 kept and written with the panorama.

The peer: views of that export, rendered anew from the exported mesh: rays, Open3D's cast_rays, attributes in numpy and
cv2.remap, PNG by OpenCV (its default level; 6 beside it), EXR of half floats by OpenEXR with ZIP. The user time of a
view times the number of images; a panorama counts as its pixels. Loading, building the tree, scoring candidates and
system time are not counted for it. semantic_pretty, which ours writes as well, is counted apart.

Both in turns, round after round; medians. Then the whole export of each scene: 1 thread against 2, and peak memory.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

S3D = Path(__file__).resolve().parent.parent / "target" / "release" / "s3d"
PEER_VIEWS = 5


class Spent:
    """User seconds of this process while in the block."""

    def __enter__(self):
        self.start = os.times().user
        return self

    def __exit__(self, *_):
        self.user = os.times().user - self.start


def export(scene, out, *options):
    """Runs an export into a new folder: user seconds, wall seconds, peak memory in MB."""
    if out.exists():
        shutil.rmtree(out)
        os.sync()
        # For five seconds ext4 does not use numbers of removed files again, and looks for others: 0.3 ms a new file.
        time.sleep(6)
    started = time.perf_counter()
    command = [S3D, "export", scene, "-o", out, "--quiet", *options]
    child = subprocess.Popen([str(c) for c in command], stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise SystemExit(f"{command} failed")
    return usage.ru_utime, time.perf_counter() - started, usage.ru_maxrss * 1024 / 1e6


def one_location(scene, folder):
    """The scene with its first location alone."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = tomllib.loads(scene.read_text())
    at = lambda section: (scene.parent / settings[section]["path"]).resolve().as_posix()
    cameras = Path(at("cameras")).read_text().splitlines(keepends=True)
    first = next(line for line in cameras if line[:1] in "0123456789abcdefABCDEF" and "," in line)
    (folder / "cameras.csv").write_text(first)
    text = (f'area = {settings["area"]}\n[mesh]\npath = "{at("mesh")}"\nup = "{settings["mesh"]["up"]}"\n'
            f'[annotations]\npath = "{at("annotations")}"\n[cameras]\npath = "cameras.csv"\n')
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def read_labels(path):
    """The label of each face of a semantic.obj, as a number."""
    numbers, labels, current = {}, [], 0
    for line in open(path):
        if line.startswith("usemtl "):
            current = numbers.setdefault(line[7:].strip(), len(numbers))
        elif line.startswith("f "):
            labels.append(current)
    return np.array(labels)


class Peer:
    """What a Python user would write."""

    def __init__(self, export_folder, scratch):
        import cv2, OpenEXR
        import open3d as o3d

        self.cv2, self.exr, self.o3c, self.scratch = cv2, OpenEXR, o3d.core, scratch
        cv2.setNumThreads(1)
        area = next(export_folder.glob("area_*"))
        mesh = o3d.io.read_triangle_mesh(str(area / "3d" / "rgb.obj"))
        x, y, z = np.asarray(mesh.vertices).T
        self.positions = np.stack([x, -z, y], 1).astype(np.float32)
        self.faces = np.asarray(mesh.triangles).astype(np.uint32)
        self.uvs = np.asarray(mesh.triangle_uvs).astype(np.float32).reshape(-1, 3, 2)
        self.labels = read_labels(area / "3d" / "semantic.obj")
        if not len(self.labels) == len(self.faces) == len(self.uvs):
            raise SystemExit("Open3D reads other faces than were written")
        self.texture = cv2.imread(str(next((area / "3d" / "rgb_textures").iterdir())))
        self.palette = np.random.default_rng(1).integers(40, 255, (self.labels.max() + 1, 3)).astype(np.uint8)
        a, b, c = (self.positions[self.faces[:, k]] for k in range(3))
        self.normals = np.cross(b - a, c - a)
        self.normals /= np.maximum(np.linalg.norm(self.normals, axis=1, keepdims=True), 1e-20)
        self.scene = o3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(o3d.core.Tensor(self.positions), o3d.core.Tensor(self.faces))
        self.scene.cast_rays(o3d.core.Tensor(np.zeros((1, 6), np.float32)))  # Builds the tree.
        self.poses = sorted((area / "data" / "pose").iterdir())

    def view(self, pose_path):
        """Renders and writes one view; user seconds of each stage."""
        cv2, times = self.cv2, {}
        pose = json.loads(pose_path.read_text())
        focal, turn = np.float32(pose["camera_k_matrix"][0][0]), np.array(pose["camera_rt_matrix"])[:, :3]
        origin = np.array(pose["camera_location"], np.float32)
        size = int(round(2 * pose["camera_k_matrix"][0][2]))
        right, down, forward = turn.astype(np.float32)
        image = lambda values: values.reshape(size, size, -1).squeeze()
        with Spent() as spent:
            across = ((np.arange(size, dtype=np.float32) + np.float32(0.5 - size / 2)) / focal)[:, None]
            d = (right * across)[None] + (down * across)[:, None] + forward
            d = d.reshape(-1, 3)
            rays = self.o3c.Tensor(np.concatenate([np.broadcast_to(origin, d.shape), d], 1))
        times["rays"] = spent.user
        with Spent() as spent:
            hits = self.scene.cast_rays(rays, nthreads=2)
            t, face, bary = (hits[k].numpy() for k in ("t_hit", "primitive_ids", "primitive_uvs"))
        times["cast"] = spent.user
        with Spent() as spent:
            seen = np.isfinite(t)
            t, face = np.where(seen, t, 0), np.where(seen, face, 0)
            unseen = ~seen
            depth = np.clip(t * 512, 0, 65535).astype(np.uint16)
            depth[unseen] = 65535
            normal = self.normals[face]
            normal = np.where((normal * d).sum(1, keepdims=True) > 0, -normal, normal) @ np.stack([right, down, -forward], 1)
            normal = (normal * 127.5 + 128).astype(np.uint8)
            normal[unseen] = 128
            label = self.labels[face]
            semantic = np.stack([label & 255, label >> 8 & 255, label >> 16], 1).astype(np.uint8)  # B, G, R
            semantic[unseen] = 13
            xyz = (origin + t[:, None] * d).astype(np.float16)
            xyz[unseen] = 0
            corners, u, v = self.uvs[face], bary[:, :1], bary[:, 1:]
            uv = corners[:, 0] * (1 - u - v) + corners[:, 1] * u + corners[:, 2] * v
            height, width = self.texture.shape[:2]
            column, row = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
            rgb = cv2.remap(self.texture, image(column).astype(np.float32), image(row).astype(np.float32), cv2.INTER_LINEAR,
                            borderMode=cv2.BORDER_REPLICATE)
            rgb[image(unseen)] = 0
        times["attributes"] = spent.user
        with Spent() as spent:
            pretty = self.palette[label]
            pretty[unseen] = 0
        times["pretty"] = spent.user
        for stage, level in (("png", []), ("png level 6", [cv2.IMWRITE_PNG_COMPRESSION, 6])):
            with Spent() as spent:
                for name, pixels in (("depth", depth), ("normal", normal[:, ::-1]), ("semantic", semantic), ("rgb", rgb)):
                    cv2.imwrite(str(self.scratch / f"peer_{name}.png"), np.ascontiguousarray(image(pixels)), level)
            times[stage] = spent.user
            with Spent() as spent:
                cv2.imwrite(str(self.scratch / "peer_pretty.png"), image(pretty), level)
            times[stage.replace("png", "pretty png")] = spent.user
        with Spent() as spent:
            header = {"compression": self.exr.ZIP_COMPRESSION, "type": self.exr.scanlineimage}
            with self.exr.File(header, {"RGB": image(xyz)}) as file:
                file.write(str(self.scratch / "peer_xyz.exr"))
        times["exr"] = spent.user
        return times

    def round(self):
        """Mean user seconds a view, by stage."""
        paths = self.poses[:: max(1, len(self.poses) // PEER_VIEWS)][:PEER_VIEWS]
        views = [self.view(path) for path in paths]
        return {stage: float(np.mean([v[stage] for v in views])) for stage in views[0]}


def count_images(out):
    """Perspective views, and the panorama in their sizes."""
    views = len(list(out.glob("area_*/data/pose/*.json")))
    size = lambda path: int.from_bytes(path.read_bytes()[16:20]) * int.from_bytes(path.read_bytes()[20:24])
    view, pano = (size(next(out.glob(f"area_*/{kind}/depth/*.png"))) for kind in ("data", "pano"))
    return views, pano / view


def folder_size(out):
    return sum(p.stat().st_size for p in out.glob("area_*/*/*/camera_*")) / 1e6


def compare_location(name, scene, scratch, rounds):
    out = scratch / f"{name}_out"
    one = one_location(scene, scratch / name)
    few = ("--points-per-m2", "100", "--threads", "1")
    export(one, out, *few)
    views, pano = count_images(out)
    megabytes = folder_size(out)
    # In a process of its own, so that its threads and memory end with it; it serves round after round.
    peer = subprocess.Popen([sys.executable, __file__, "--peer", str(out), str(scratch)], stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, text=True)
    ask = lambda: (peer.stdin.write("go\n"), peer.stdin.flush(), json.loads(peer.stdout.readline()))[2]
    ask()
    ours, base, theirs = [], [], []
    for _ in range(rounds):
        ours.append(export(one, scratch / "again", *few)[0])
        theirs.append(ask())
        base.append(export(one, scratch / "again", *few, "--views", "0", "--modalities", "pose")[0])
    peer.stdin.close()
    peer.wait()
    stage = {k: float(np.median([t[k] for t in theirs])) for k in theirs[0]}
    location = np.array(ours) - np.median(base)
    images = views + pano
    print(f"{name}: {views} views and a panorama (of {pano:.2f} views): {megabytes:.0f} MB")
    print("  the peer, ms a view: " + ", ".join(f"{k} {1e3 * v:.0f}" for k, v in stage.items()))
    common = ("rays", "cast", "attributes", "exr")
    rows = {
        "PNG by default": common + ("png",),
        "PNG by default, pretty too": common + ("png", "pretty", "pretty png"),
        "PNG level 6": common + ("png level 6",),
        "PNG level 6, pretty too": common + ("png level 6", "pretty", "pretty png level 6"),
    }
    mine = float(np.median(location))
    print(f"  ours: {mine:.2f} core-seconds a location ({min(location):.2f}–{max(location):.2f}), {1e3 * mine / images:.0f} ms "
          f"an image; {np.median(base):.2f} s of reading, labelling and sampling not counted")
    for what, stages in rows.items():
        totals = np.array([sum(t[k] for k in stages) * images for t in theirs])
        ratio = totals / location
        print(f"  Open3D + OpenCV + OpenEXR, {what}: {np.median(totals):.1f} core-seconds; "
              f"{np.median(ratio):.1f} times ours ({min(ratio):.1f}–{max(ratio):.1f})")
    sys.stdout.flush()
    return out


def compare_threads(name, scene, scratch, rounds):
    """Walls of 1 and 2 threads in turns, and peak memory."""
    walls, memory, users = {1: [], 2: []}, {}, {1: [], 2: []}
    out = scratch / "again"
    for _ in range(rounds):
        for threads in (1, 2):
            user, wall, peak = export(scene, out, "--threads", threads)
            walls[threads].append(wall)
            users[threads].append(user)
            memory[threads] = max(memory.get(threads, 0), peak)
    ratio = np.array(walls[1]) / np.array(walls[2])
    mesh = next(out.glob("area_*/3d/rgb.obj"))
    count = lambda tag: sum(line.startswith(tag) for line in open(mesh))
    bytes_of_mesh = 12 * count("v ") + 8 * count("vt ") + 28 * count("f ")
    import cv2
    texels = sum(int(np.prod(cv2.imread(str(p)).shape)) for p in (mesh.parent / "rgb_textures").iterdir())
    print(f"{name}, whole export: {np.median(walls[1]):.1f} s on 1 thread, {np.median(walls[2]):.1f} s on 2: "
          f"{np.median(ratio):.2f} times as fast ({min(ratio):.2f}–{max(ratio):.2f}); user {np.median(users[1]):.1f} and "
          f"{np.median(users[2]):.1f} s; peak memory {memory[1]:.0f} and {memory[2]:.0f} MB, of which mesh and textures "
          f"{(bytes_of_mesh + texels) / 1e6:.0f} MB", flush=True)


def main():
    if sys.argv[1:2] == ["--peer"]:
        peer = Peer(Path(sys.argv[2]), Path(sys.argv[3]))
        for _ in sys.stdin:
            print(json.dumps(peer.round()), flush=True)
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scratch", type=Path, help="where data sets go; a temporary folder if not given")
    args = parser.parse_args()
    temporary = None if args.scratch else tempfile.TemporaryDirectory()
    scratch = args.scratch or Path(temporary.name)
    for scene in args.scenes:
        name = scene.resolve().parent.name
        compare_location(name, scene, scratch, args.rounds)
        compare_threads(name, scene, scratch, args.rounds)


if __name__ == "__main__":
    main()
