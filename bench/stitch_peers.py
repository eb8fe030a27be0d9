"""A location's cube map from 18 captures, OpenCV against `s3d export`; a whole location with and without them.

    cargo build --release -p s3d-cli
    python3 -m venv venv && venv/bin/pip install numpy opencv-python-headless
    venv/bin/python bench/stitch_peers.py [--s3d S3D] [--rounds N] [--scratch DIR] [--whole] [--pictures]

Needs Linux. The scene is the built-in one (`s3d demo`) with one location. Its captures are made by `s3d render`:
1280 x 1024 pixels, three rings of six, 0.85 radians up, level and down, each 4 cm ahead of the centre, bent by
a lens and written as JPEG.

The peer makes the six faces of 2176 pixels that s3d makes of them. Its maps come from numpy or, without
parallax, from cv2.initUndistortRectifyMap; their time is apart, since a rig without parallax needs them once.
Only the part of a face that a capture sees is made. cv2.remap samples it, bilinearly, and cv2.detail blends:
its FeatherBlender, and its MultiBandBlender with five bands and seams halfway between the captures' middles.
The depths of the faces and of the captures, which tell what hides what, come from `s3d render`; neither they
nor reading the pictures count. The peer does not bring exposures together, as s3d does.

Ours: processor time of an export of panoramas 64 pixels wide with captures, less that of the same with
textures. So reading the 18 JPEG files counts. The location is there four times, under other names, and a fourth
is taken. One thread each, in turns, round after round; medians of processor time, user and system.

PSNR is of panoramas of 4096 x 2048 against the one with textures, where the captures see something. That of
the peer's cube map is made by s3d, as of a sky box, so that nothing but the cube maps differs.

--whole exports the location at full size both ways, in turns. --pictures leaves cube maps and panoramas in
the scratch folder.
"""

import argparse
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

S3D = Path(__file__).resolve().parent.parent / "target" / "release" / "s3d"
UUID = "00000000000000000000000000000001"
LOCATION = np.array([16.9, 8.35, 1.52])
WIDTH, HEIGHT, FOCAL, CENTER = 1280, 1024, 1075.7, (636.9, 515.0)
DISTORTION = np.array([0.11, -0.23, 0.0012, -0.0007, 0.05])
K = np.array([[FOCAL, 0, CENTER[0]], [0, FOCAL, CENTER[1]], [0, 0, 1]])
OFF_CENTER = 0.04
FACE = 2176
LOCATIONS = 4
BANDS = 5
# How far behind the nearest surface a point is still seen, as a part of its depth and in metres.
BEHIND = (0.01, 0.02)


def run(command):
    """Processor seconds, user and system."""
    words = [str(c) for c in command]
    child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    message = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{words} failed:\n{message}")
    return usage.ru_utime + usage.ru_stime


def axes(yaw, pitch):
    """World to camera, in OpenCV's axes: heading to the left of +Y, and above the horizon."""
    forward = np.array([-np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    return np.stack([right, np.cross(forward, right), forward])


# Up, right, back, left, front, down.
FACES = [axes(yaw, pitch) for yaw, pitch in
         [(0, np.pi / 2), (-np.pi / 2, 0), (np.pi, 0), (np.pi / 2, 0), (0, 0), (0, -np.pi / 2)]]
# By camera and stop.
RIG = [axes(-stop * np.pi / 3, pitch) for pitch in (0.85, 0.0, -0.85) for stop in range(6)]


def place_of(turn):
    return LOCATION + OFF_CENTER * turn[2]


def render(s3d, mesh, cameras, width, height, focal, center, out):
    """What pinholes at (turn, place) see: paths by modality."""
    frames = []
    for k, (turn, place) in enumerate(cameras):
        matrix = np.eye(4)
        matrix[:3, :3] = (np.diag([1, -1, -1]) @ turn).T
        matrix[:3, 3] = place
        frames.append({"file_path": f"{k:02}.png", "transform_matrix": matrix.tolist()})
    lens = {"w": width, "h": height, "fl_x": focal, "fl_y": focal, "cx": center[0], "cy": center[1]}
    out.mkdir(parents=True)
    poses = out / "poses.json"
    poses.write_text(json.dumps(lens | {"frames": frames}))
    run([s3d, "render", mesh, "--poses", poses, "-o", out / "images", "--compression", "fast", "--quiet"])
    return [{m: out / "images" / m / f"{k:02}.png" for m in ("rgb", "depth")} for k in range(len(cameras))]


def metres(path):
    """Depths, infinite where there is nothing."""
    raw = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return np.where(raw == 65535, np.inf, raw / np.float32(512)).astype(np.float32)


class Captures:
    """The 18 pictures in a folder, as a scanner writes them, and what hides what in them."""

    def __init__(self, s3d, mesh, folder, scratch):
        folder.mkdir(parents=True)
        # Rendered twice as finely and a little wider, since the lens bends lines.
        size, fine = 2 * np.round([1.03 * WIDTH, 1.03 * HEIGHT]), 2 * FOCAL
        cameras = [(turn, place_of(turn)) for turn in RIG]
        width, height = size.astype(int)
        images = render(s3d, mesh, cameras, int(width), int(height), fine, size / 2, scratch / "captures")
        self.fine, self.middle = fine, size / 2 - 0.5
        x, y = np.meshgrid((np.arange(2 * WIDTH) + 0.5) / 2, (np.arange(2 * HEIGHT) + 0.5) / 2)
        seen = cv2.undistortPoints(np.stack([x.ravel(), y.ravel()], 1), K, DISTORTION).reshape(*x.shape, 2)
        self.reach = 1.005 * float(np.sqrt((seen**2).sum(2).max()))
        to_fine = (seen * fine + self.middle).astype(np.float32)
        self.pictures, self.limits = [], []
        for k, image in enumerate(images):
            picture = cv2.remap(cv2.imread(str(image["rgb"])), to_fine, None, cv2.INTER_LINEAR)
            name = f"{UUID}_{{}}_{k // 6}_{k % 6}.txt"
            path = folder / f"{UUID}_i{k // 6}_{k % 6}.jpg"
            picture = cv2.resize(picture, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
            cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
            self.pictures.append(cv2.imread(str(path)))
            far = cv2.dilate(metres(image["depth"]), np.ones((3, 3), np.uint8))
            self.limits.append(far * np.float32(1 + BEHIND[0]) + np.float32(BEHIND[1]))
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = RIG[k].T, place_of(RIG[k])
            np.savetxt(folder / name.format("pose"), matrix, "%.9f")
        numbers = " ".join(str(v) for v in (WIDTH, HEIGHT, FOCAL, FOCAL, *CENTER, *DISTORTION))
        for camera in range(3):
            (folder / f"{UUID}_intrinsics_{camera}.txt").write_text(numbers + "\n")


class Spent:
    """Processor seconds of this process, summed over the blocks."""

    def __init__(self):
        self.seconds = 0.0

    def __enter__(self):
        self.start = time.process_time()

    def __exit__(self, *_):
        self.seconds += time.process_time() - self.start


class Part:
    """What a capture sees of a face: the rectangle, and where each of its pixels is in the picture."""

    def __init__(self, capture, corner, maps, weight):
        self.capture, self.corner, self.maps, self.weight = capture, corner, maps, weight
        self.mask = (weight > 0).astype(np.uint8) * 255


class Peer:
    """What a Python user would write."""

    def __init__(self, captures, depths):
        self.captures, self.depths = captures, depths
        self.places = (np.arange(FACE, dtype=np.float32) + np.float32(0.5)) * np.float32(2 / FACE) - 1

    def toward(self, face, capture, columns, rows, depth):
        """What pixels of a face look at, in the axes of a capture's camera."""
        turn = (RIG[capture] @ FACES[face].T).astype(np.float32)
        x, y = self.places[columns][None], self.places[rows][:, None]
        v = [turn[k, 0] * x + (turn[k, 1] * y + turn[k, 2]) for k in range(3)]
        if depth is None:
            return v
        shift = (RIG[capture] @ (LOCATION - place_of(RIG[capture]))).astype(np.float32)
        return [v[k] * depth + shift[k] for k in range(3)]

    def rectangle(self, face, capture):
        """Around what the capture may see of the face: columns and rows."""
        every = np.arange(0, FACE, 16)
        x, y, z = self.toward(face, capture, every, every, None)
        inside = (z > 0) & (np.maximum(abs(x) / (WIDTH / 2), abs(y) / (HEIGHT / 2)) * FOCAL < 1.1 * z)
        if not inside.any():
            return None
        ends = [every[np.flatnonzero(inside.any(axis))[[0, -1]]] for axis in (0, 1)]
        return [slice(max(int(low) - 16, 0), min(int(high) + 32, FACE)) for low, high in ends]

    def part(self, face, capture, parallax):
        found = self.rectangle(face, capture)
        if not found:
            return None
        columns, rows = found
        depth = np.minimum(self.depths[face][rows, columns], np.float32(1e6)) if parallax else None
        x, y, z = self.toward(face, capture, columns, rows, depth)
        seen = z > 0
        x /= z
        y /= z
        r2 = x * x + y * y
        seen &= r2 < self.captures.reach**2
        if parallax:
            fine, middle = np.float32(self.captures.fine), self.captures.middle.astype(np.float32)
            limits = self.captures.limits[capture]
            seen &= z <= cv2.remap(limits, x * fine + middle[0], y * fine + middle[1], cv2.INTER_NEAREST)
            k1, k2, p1, p2, k3 = DISTORTION.astype(np.float32)
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
            xy = 2 * x * y
            x, y = x * radial + p1 * xy + p2 * (r2 + 2 * x * x), y * radial + p2 * xy + p1 * (r2 + 2 * y * y)
            maps = [v * np.float32(FOCAL) + np.float32(c - 0.5) for v, c in zip((x, y), CENTER)]
        else:
            # OpenCV counts pixels from their centres.
            lens, half = K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]], FACE / 2
            middle = half - 0.5 - np.array([columns.start, rows.start])
            pinhole = np.array([[half, 0, middle[0]], [0, half, middle[1]], [0, 0, 1]])
            turn, size = FACES[face] @ RIG[capture].T, z.shape[::-1]
            maps = cv2.initUndistortRectifyMap(lens, DISTORTION, turn, pinhole, size, cv2.CV_32FC1)
        # 1 in the middle of the picture and 0 at its border.
        across, down = (1 - (m * np.float32(2 / n) - 1) ** 2 for m, n in zip(maps, (WIDTH - 1, HEIGHT - 1)))
        weight = np.where(seen & (across > 0) & (down > 0), across * down, np.float32(0))
        return Part(capture, (columns.start, rows.start), maps, weight) if weight.any() else None

    def parts(self, face, parallax):
        """With seams where another capture has a pixel nearer its middle."""
        parts = [p for k in range(len(RIG)) if (p := self.part(face, k, parallax))]
        best = np.zeros((FACE, FACE), np.float32)
        for again in (False, True):
            for part in parts:
                (x, y), (h, w) = part.corner, part.weight.shape
                there = best[y : y + h, x : x + w]
                if again:
                    part.seam = ((part.weight == there) & (there > 0)).astype(np.uint8) * 255
                else:
                    np.maximum(there, part.weight, out=there)
        return parts

    def cube_map(self, parallax):
        """Faces and what is seen of them by blender; seconds by step."""
        maps, remap = Spent(), Spent()
        blenders = {"multi-band": (lambda: cv2.detail.MultiBandBlender(0, BANDS), Spent()),
                    "feather": (lambda: cv2.detail.FeatherBlender(), Spent())}
        faces = {name: [] for name in blenders}
        for face in range(6):
            with maps:
                parts = self.parts(face, parallax)
            with remap:
                pictures = [cv2.remap(self.captures.pictures[p.capture], *p.maps, cv2.INTER_LINEAR,
                                      borderMode=cv2.BORDER_REPLICATE) for p in parts]
            for name, (make, spent) in blenders.items():
                with spent:
                    blender = make()
                    blender.prepare((0, 0, FACE, FACE))
                    for part, picture in zip(parts, pictures):
                        mask = part.seam if name == "multi-band" else part.mask
                        blender.feed(picture.astype(np.int16), mask, part.corner)
                    image, mask = blender.blend(None, None)
                    image = np.clip(image, 0, 255).astype(np.uint8)
                faces[name].append((image, mask))
        times = {"maps": maps.seconds, "remap": remap.seconds}
        return faces, times | {name: spent.seconds for name, (_, spent) in blenders.items()}


def psnr(a, b, where):
    difference = (a.astype(np.float32) - b)[where]
    return 10 * np.log10(255**2 / np.mean(difference**2))


class Ours:
    """Exports of the location, with and without captures."""

    SOURCES = {
        "textures": [],
        "parallax": ['source = "captures"', 'path = "raw"', f"size = {FACE}"],
        "plain": ['source = "captures"', 'path = "raw"', f"size = {FACE}", "parallax = false"],
        "sky box": ['source = "skybox"', 'path = "sky_box"', 'caps = "front"'],
    }

    def __init__(self, s3d, scan, scratch):
        self.s3d, self.scan, self.folder, self.out = s3d, scan, scratch / "scan", scratch / "out"
        self.uuids = [f"{k + 1:032}" for k in range(LOCATIONS)]
        for path in sorted((self.folder / "raw").iterdir()):
            for uuid in self.uuids[1:]:
                os.link(path, path.with_name(path.name.replace(UUID, uuid)))

    def export(self, source, *options, locations=1, labels=False, gains=True):
        """Processor seconds."""
        place = ",".join(str(v) for v in LOCATION)
        table = "".join(f"{uuid},{place},0,0,0,1\n" for uuid in self.uuids[:locations])
        (self.folder / "cameras.csv").write_text(table)
        lines = ["area = 1", "[mesh]", f'path = "{self.scan / "rgb.obj"}"', 'up = "y"']
        lines += ["[cameras]", 'path = "cameras.csv"']
        lines += ["[annotations]", f'path = "{self.scan / "Area_1"}"'] if labels else []
        lines += ["[rgb]", *self.SOURCES[source]] if source != "textures" else []
        lines += [] if gains else ["gains = false"]
        scene = self.folder / "scene.toml"
        scene.write_text("\n".join(lines) + "\n")
        if self.out.exists():
            shutil.rmtree(self.out)
        os.sync()
        return run([self.s3d, "export", scene, "-o", self.out, "--threads", "1", "--quiet", *options])

    def cube_maps(self, source):
        """Seconds of an export of nearly nothing else."""
        small = ("--views", "0", "--modalities", "rgb", "--pano-width", "64", "--points-per-m2", "100")
        return self.export(source, *small, locations=LOCATIONS)

    def panorama(self, source, gains=True):
        self.export(source, "--views", "0", "--modalities", "rgb", "--points-per-m2", "100", gains=gains)
        return cv2.imread(str(next(self.out.glob("area_*/pano/rgb/*.png"))))

    def panorama_of(self, faces):
        """The panorama of another's cube map."""
        folder = self.folder / "sky_box"
        folder.mkdir(exist_ok=True)
        for k, face in enumerate(faces):
            # What reads it goes by the first bytes.
            (folder / f"{UUID}_skybox{k}_sami.jpg").write_bytes(cv2.imencode(".png", face)[1].tobytes())
        return self.panorama("sky box")


def median(values):
    return f"{np.median(values):.2f} s ({min(values):.2f}–{max(values):.2f})"


def cube_maps(ours, peer, scratch, rounds, pictures):
    peer.cube_map(False)
    mesh = ours.panorama("textures")
    made = {"mesh": mesh}
    for source in ("parallax", "plain"):
        with_pictures, base, theirs = [], [], []
        for _ in range(rounds):
            with_pictures.append(ours.cube_maps(source))
            faces, times = peer.cube_map(source == "parallax")
            theirs.append(times)
            base.append(ours.cube_maps("textures"))
        own = (np.array(with_pictures) - np.median(base)) / LOCATIONS
        print(f"{source}: ours {median(own)}")
        print("  OpenCV: " + ", ".join(f"{k} {np.median([t[k] for t in theirs]):.2f} s" for k in theirs[0]))
        for name in faces:
            blended = np.array([t["remap"] + t[name] for t in theirs])
            whole = blended + [t["maps"] for t in theirs]
            print(f"  {name}: with maps {median(whole)}, {np.median(whole / own):.2f} times ours; "
                  f"without {median(blended)}, {np.median(blended / own):.2f}")
            made[f"{source}_{name}"] = ours.panorama_of([face for face, _ in faces[name]])
            seen = ours.panorama_of([mask for _, mask in faces[name]]).min(2) == 255
            if pictures:
                for k, (face, _) in enumerate(faces[name]):
                    cv2.imwrite(str(scratch / f"{source}_{name}_{k}.png"), face)
        seen = cv2.erode(seen.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
        made[f"{source}_ours"] = ours.panorama(source)
        made[f"{source}_ours without gains"] = ours.panorama(source, gains=False)
        quality = {k.split("_")[1]: psnr(v, mesh, seen) for k, v in made.items() if k.startswith(source)}
        told = ", ".join(f"{k} {v:.2f} dB" for k, v in quality.items())
        print(f"  PSNR of {100 * seen.mean():.0f} % of the panorama: {told}", flush=True)
    if pictures:
        for name, image in made.items():
            cv2.imwrite(str(scratch / f"{name}.png"), image)


def whole_location(ours, rounds):
    times = {source: [] for source in ("textures", "parallax")}
    few = ("--views", "0", "--modalities", "pose")
    base = []
    for _ in range(rounds):
        for source, seconds in times.items():
            seconds.append(ours.export(source, labels=True))
        base.append(ours.export("textures", *few, labels=True))
    for source, seconds in times.items():
        print(f"whole export, {source}: {median(seconds)}")
    print(f"without images: {median(base)}")
    textures, captures = (np.array(t) for t in times.values())
    print(f"captures / textures: {np.median(captures / textures):.2f}; less what is no image: "
          f"{np.median((captures - np.median(base)) / (textures - np.median(base))):.2f}")


def main():
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("--s3d", type=Path, default=S3D)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scratch", type=Path, help="a new folder for all files; else a temporary one")
    parser.add_argument("--whole", action="store_true", help="export the location at full size, too")
    parser.add_argument("--pictures", action="store_true", help="leave cube maps and panoramas there")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as temporary:
        scratch = (args.scratch or Path(temporary)).resolve()
        run([args.s3d, "demo", "-o", scratch / "demo", "--no-images", "--quiet"])
        scan = scratch / "demo" / "scan"
        captures = Captures(args.s3d, scan / "rgb.obj", scratch / "scan" / "raw", scratch)
        corner = (FACE / 2, FACE / 2)
        cameras = [(turn, LOCATION) for turn in FACES]
        faces = render(args.s3d, scan / "rgb.obj", cameras, FACE, FACE, FACE / 2, corner, scratch / "faces")
        peer = Peer(captures, [metres(face["depth"]) for face in faces])
        ours = Ours(args.s3d, scan, scratch)
        cube_maps(ours, peer, scratch, args.rounds, args.pictures)
        if args.whole:
            whole_location(ours, args.rounds)


if __name__ == "__main__":
    main()
