"""Reads every file of a data set that s3d wrote, and puts pixels back into the world.

    python utils.py OUT        # checks a data set: reads some of everything, compares depth with coordinates

Needs numpy (1.22 or later, 2 too), one of pillow and opencv for PNG, and OpenEXR 3.3 or later for coordinates.
What the numbers mean stands in OUT/conventions.json; this module follows it. As a module:

    import utils
    data = utils.Dataset("OUT")
    for image in data.images("pano"):                 # or "data": perspective views
        rgb, depth = data.rgb(image), data.depth(image)      # uint8, metres with NaN where missing
        world = data.world_points(image)                     # from depth and pose: (H, W, 3) metres, Z up
        index = data.semantic(image)                         # -1 where nothing was seen, 0 without a label
        classes = data.class_of_label[index]                 # places in data.classes, -1 for none (index -1 too)
"""

import argparse
import json
import sys
from collections import namedtuple
from pathlib import Path

import numpy as np

CLASSES = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split()
NULL_LABEL = "<UNK>_0_<UNK>_0_0"

Label = namedtuple("Label", "class_name instance room_type room area")
Image = namedtuple("Image", "area kind stem")  # 1, "data" or "pano", "camera_{uuid}_{roomType}_{roomNum}_frame_{frame}"


# ---- From pixels to the world -----------------------------------------------------------------------------------------


def world_from_view(pose, depth):
    """Points (H, W, 3) in world metres of a perspective view, from its pose file and its depth in metres."""
    K, RT = np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"])
    height, width = depth.shape
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)  # the middle of a pixel is at one half
    rays = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)], axis=-1)
    camera = rays * depth[..., None]  # x right, y down, z forward: depth is along z
    return (camera - RT[:, 3]) @ RT[:, :3]  # inverse of R p + t: transpose(R) (c - t), for rows


def world_from_panorama(pose, distance):
    """The same of a panorama, whose depth is the distance from the camera. Its K is not used."""
    height, width = distance.shape
    forward = np.array(pose["camera_rt_matrix"])[2, :3]
    ahead = np.arctan2(forward[1], forward[0])  # where the middle column looks
    lon = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi  # grows to the right
    lat = (0.5 - (np.arange(height) + 0.5) / height) * np.pi
    lon, lat = np.meshgrid(lon, lat)
    rays = np.stack([np.cos(lat) * np.cos(ahead - lon), np.cos(lat) * np.sin(ahead - lon), np.sin(lat)], axis=-1)
    return np.array(pose["camera_location"]) + rays * distance[..., None]


def pixels_from_world(pose, points):
    """Where world points (..., 3) are in a view: pixel coordinates (..., 2) and depth; below 0 is behind the camera."""
    K, RT = np.array(pose["camera_k_matrix"]), np.array(pose["camera_rt_matrix"])
    camera = points @ RT[:, :3].T + RT[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return camera[..., :2] / camera[..., 2:] * np.diag(K)[:2] + K[:2, 2], camera[..., 2]


def rotation(angles):
    """Rz @ Ry @ Rx of the three angles of a pose file: camera (x right, y up, looking along -z) to world."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(angles), np.cos(angles)
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ ry @ rx


# ---- Single files -----------------------------------------------------------------------------------------------------


def read_png(path):
    """An 8-bit RGB image (H, W, 3) or a gray one (H, W) of 8 or 16 bits."""
    try:
        from PIL import Image as Pillow

        with Pillow.open(path) as image:
            pixels = np.asarray(image)
    except ImportError:
        import cv2

        pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if pixels is None:
            raise OSError(f"{path}: no readable image") from None
        if pixels.ndim == 3:
            pixels = pixels[..., ::-1]
    return pixels.astype(np.uint16) if pixels.ndim == 2 else pixels


def read_depth(path, units_per_m=512):
    """Depth in metres, NaN where it is missing or too far: along the optical axis in views, distance in panoramas."""
    depth = read_png(path)
    return np.where(depth == 65535, np.nan, depth / units_per_m)


def read_normals(path):
    """Unit vectors (H, W, 3), NaN where missing. Views: right, down, towards the camera (or forward, where
    conventions.json says "opencv"). Panoramas: X, -Z, Y of the world."""
    pixels = read_png(path)
    normals = (pixels - 127.5) / 127.5
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[(pixels == 128).all(axis=-1)] = np.nan
    return normals


def read_semantic(path):
    """Indices into the label table (H, W): -1 where nothing was seen."""
    index = read_png(path).astype(np.int32) @ np.array([65536, 256, 1], np.int32)
    return np.where(index == 0x0D0D0D, -1, index)


def decode_mask(mask):
    """COCO's compressed run lengths as (H, W) of bool."""
    runs, number, place = [], 0, 0
    for byte in mask["counts"].encode():
        bits = byte - 48
        number |= (bits & 31) << place
        place += 5
        if bits & 32:
            continue
        if bits & 16:
            number -= 1 << place
        runs.append(number + (runs[-2] if len(runs) > 2 else 0))
        number, place = 0, 0
    height, width = mask["size"]
    return np.repeat(np.arange(len(runs)) % 2 == 1, runs).reshape(width, height).T


def read_semantic_class(path):
    """Places of classes in the taxonomy (H, W): -1 where nothing was seen, or what was seen has no class. The file is a PNG
    with a palette, which readers of colours turn into the classes' colours."""
    from PIL import Image as Pillow

    with Pillow.open(path) as image:
        if image.mode != "P":
            raise ValueError(f"{path}: no image with a palette")
        place = np.asarray(image).astype(np.int32)
    return np.where(place == 255, -1, place)


def read_xyz(path):
    """World coordinates (H, W, 3) in metres, NaN where missing; float16 or float32 as stored."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        if "RGB" in channels:
            xyz = np.array(channels["RGB"].pixels)
        else:
            xyz = np.stack([channels[name].pixels for name in "RGB"], axis=-1)
    xyz[(xyz == 0).all(axis=-1)] = np.nan
    return xyz


def read_json(path):
    """A pose, the manifest, any table."""
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def parse_label(name):
    """The parts of a label, None for the null label."""
    if name == NULL_LABEL:
        return None
    class_name, instance, room_type, room, area = name.split("_")
    return Label(class_name, int(instance), room_type, int(room), int(area))


def read_instances(path):
    """instances.npz as a list of dicts: label, label_index, bbox, occupancy and counts (6, 6, 6), and points: the numbers of
    the instance's annotated points, voxel after voxel."""
    with np.load(path) as arrays:
        a = {name: arrays[name] for name in arrays.files}
    starts = a["point_start"].astype(np.int64)
    return [
        {
            "label": str(a["labels"][i]),
            "label_index": int(a["label_index"][i]),
            "bbox": a["bbox"][i],
            "occupancy": a["voxel_occupancy"][i].astype(bool),
            "counts": a["points_per_voxel"][i],
            "points": a["point_index"][starts[i] : starts[i + 1]],
        }
        for i in range(len(a["labels"]))
    ]


def read_votes(path):
    """votes.npz: by face of rgb.obj, (F,) each: label and runner_up (indices into the label table), votes, total and
    runner_up_votes, and farthest_m, the distance of the farthest voter. A label without votes was filled in."""
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def read_source_faces(path):
    """source_faces.npz: files, the names of the files of the scan's mesh; and by face of rgb.obj, (F,) each: file, a place in
    files, and face, the number there, from 0. So labels of the scan's own faces are `labels[source["face"]]`."""
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def read_s3dis_room(folder, classes=CLASSES):
    """A room of the S3DIS tree: xyz (N, 3) metres, rgb (N, 3) 0..255, class (N,) as a place in classes, -1 for a word that is
    none of them and no clutter, instance (N,) from 1."""
    parts = []
    for number, path in enumerate(sorted(Path(folder, "Annotations").glob("*.txt")), 1):
        rows = np.loadtxt(path, ndmin=2)
        name = path.name.split("_")[0]
        name = name if name in classes else "clutter"
        kind = classes.index(name) if name in classes else -1
        parts.append(np.column_stack([rows[:, :6], np.full(len(rows), kind), np.full(len(rows), number)]))
    rows = np.concatenate(parts) if parts else np.empty((0, 8))
    return rows[:, :3], rows[:, 3:6].astype(np.uint8), rows[:, 6].astype(np.int64), rows[:, 7].astype(np.int64)


def read_points(path):
    """pointcloud.ply as a structured array: x y z red green blue label face."""
    kinds = {"float": "<f4", "uchar": "u1", "uint": "<u4"}
    with open(path, "rb") as file:
        count, fields = 0, []
        for line in iter(lambda: file.readline().split(), [b"end_header"]):
            if not line:
                raise ValueError(f"{path}: no end of the header")
            if line[:2] == [b"element", b"vertex"]:
                count = int(line[2])
            elif line[0] == b"property":
                fields.append((line[2].decode(), kinds[line[1].decode()]))
        return np.fromfile(file, np.dtype(fields), count)


def read_obj(path):
    """rgb.obj or semantic.obj: vertices (N, 3) in the Z-up world, faces (M, 3), and the name of each face's material: its
    label in semantic.obj."""
    vertices, faces, materials, material = [], [], [], ""
    with open(path, encoding="utf-8") as file:
        for line in file:
            kind, _, rest = line.partition(" ")
            if kind == "v":
                vertices.append([float(word) for word in rest.split()[:3]])
            elif kind == "usemtl":
                material = rest.strip()
            elif kind == "f":
                corners = [int(word.split("/")[0]) - 1 for word in rest.split()]
                faces.append(corners)
                materials.append(material)
    x, y, z = np.array(vertices, np.float64).reshape(-1, 3).T
    return np.column_stack([x, -z, y]), np.array(faces, np.int64).reshape(-1, 3), materials


# ---- A whole data set -------------------------------------------------------------------------------------------------


class Dataset:
    """The files of a data set, by image."""

    def __init__(self, root):
        self.root = Path(root)
        self.conventions = read_json(self.root / "conventions.json")
        self.manifest = read_json(self.root / "manifest.json")
        self.areas = self.manifest["area_numbers"]
        self.is_labelled = self.manifest["labels"] > 0
        # Class names, and all that is known of them where they are not S3DIS's: ids, colours, what they count as.
        self.classes, self.taxonomy = CLASSES, None
        if "taxonomy" in self.manifest:
            self.taxonomy = read_json(self.root / "assets/taxonomy.json")
            self.classes = [entry["name"] for entry in self.taxonomy["classes"]]
        # Without labels: nothing but the one that means that there is none.
        self.label_names = ["<UNK>_0_<UNK>_0_0"]
        if self.is_labelled:
            self.label_names = read_json(self.root / "assets/semantic_labels.json")
        self.labels = [parse_label(name) for name in self.label_names]
        # One entry more: index -1, nothing seen, has no class either.
        kinds = [self.classes.index(label.class_name) if label else -1 for label in self.labels]
        self.class_of_label = np.array(kinds + [-1], np.int64)
        self.files = {folder: (suffix, ext) for folder, suffix, ext in self.conventions["files"]["folder_suffix_ext"]}

    def images(self, kind, areas=None):
        """All images of a kind, "data" or "pano", in the order of their names."""
        found = []
        for area in areas or self.areas:
            stems = set()
            for folder in self.files:
                stems |= {p.name.split("_domain_")[0] for p in self._folder(area, kind, folder).glob("camera_*")}
            found += [Image(area, kind, stem) for stem in sorted(stems)]
        return found

    def _folder(self, area, kind, folder):
        return self.root / f"area_{area}" / kind / folder

    def path(self, image, folder):
        suffix, ext = self.files[folder]
        return self._folder(image.area, image.kind, folder) / f"{image.stem}_domain_{suffix}.{ext}"

    def rgb(self, image):
        return read_png(self.path(image, "rgb"))

    def depth(self, image):
        return read_depth(self.path(image, "depth"), self.conventions["depth"]["units_per_m"])

    def photographs(self, area):
        """What frames.json tells of the photographs of an area: a dict each, with the Image of its view as "image"."""
        path = self.root / f"area_{area}" / "frames.json"
        records = read_json(path) if path.exists() else []
        stem = "camera_{camera_uuid}_{room}_frame_"
        of_view, of_panorama = ("data", stem + "0"), ("pano", stem + "equirectangular")
        kinds = [of_panorama if r.get("panorama") else of_view for r in records]
        return [{**r, "image": Image(area, kind, stem.format(**r))} for r, (kind, stem) in zip(records, kinds)]

    def mask(self, image):
        """Where an image has colours, (H, W) of bool: of a photograph all but what lies outside of it."""
        return (self.rgb(image) != 0).any(axis=-1)

    def normals(self, image):
        return read_normals(self.path(image, "normal"))

    def semantic(self, image):
        return read_semantic(self.path(image, "semantic"))

    def semantic_class(self, image):
        return read_semantic_class(self.path(image, "semantic_class"))

    def semantic_refined(self, image):
        """Indices as those of `semantic`, with borders at the edges of the picture."""
        return read_semantic(self.path(image, "semantic_refined"))

    def semantic_moved(self, image):
        """Where `semantic_refined` has another label than `semantic`."""
        return read_png(self.path(image, "semantic_moved")) > 0

    def depth_euclidean(self, image):
        """Distances from the camera in metres, NaN where missing."""
        return read_depth(self.path(image, "depth_euclidean"), self.conventions["depth"]["units_per_m"])

    def reshading(self, image):
        """Light from 0 to 1, NaN where nothing is seen."""
        pixels = read_png(self.path(image, "reshading"))
        return np.where(pixels == 0, np.nan, pixels / 255)

    def principal_curvature(self, image):
        """The larger and the smaller principal curvature (H, W, 2) in 1/m, NaN where nothing is seen."""
        pixels = read_png(self.path(image, "principal_curvature"))
        curvatures = (pixels[..., :2].astype(np.float64) - 127) / 127 / 0.03
        return np.where((pixels == 255).all(axis=-1)[..., None], np.nan, curvatures)

    def edge_occlusion(self, image):
        return read_png(self.path(image, "edge_occlusion")) > 0

    def edge_texture(self, image):
        return read_png(self.path(image, "edge_texture")) / (255 * 4)

    def keypoints2d(self, image):
        return (read_png(self.path(image, "keypoints2d")) / 2048) ** 2

    def keypoints3d(self, image):
        return (read_png(self.path(image, "keypoints3d")) / 255) ** 2 / 27

    def segment_unsup2d(self, image):
        """Numbers of segments of similar colour, from 1; 0 where nothing is seen."""
        return read_png(self.path(image, "segment_unsup2d"))

    def segment_unsup25d(self, image):
        """Numbers of segments of surfaces, from 1; 0 where nothing is seen."""
        return read_png(self.path(image, "segment_unsup25d"))

    def mask_valid(self, image):
        return read_png(self.path(image, "mask_valid")) > 0

    def edge_instance(self, image):
        return read_png(self.path(image, "edge_instance")) > 0

    def boundary_distance(self, image):
        """Distances to the nearest border in pixels, at most 1023.97; NaN where nothing is seen."""
        return read_depth(self.path(image, "boundary_distance"), 64)

    def xyz(self, image):
        return read_xyz(self.path(image, "global_xyz"))

    def pose(self, image):
        return read_json(self.path(image, "pose"))

    def objects(self, image):
        """The instances with a pixel in an image: a dict for each, whose "amodal_mask" decode_mask reads."""
        return read_json(self.path(image, "objects"))["objects"]

    def world_points(self, image):
        """Points in the world from depth and pose."""
        convert = world_from_panorama if image.kind == "pano" else world_from_view
        return convert(self.pose(image), self.depth(image))

    def world_normals(self, image):
        """Normals in the world's axes."""
        normals = self.normals(image)
        if image.kind == "pano":
            return np.stack([normals[..., 0], normals[..., 2], -normals[..., 1]], axis=-1)
        towards = self.conventions["normal"]["axes"] == "paper"
        opencv = normals * [1, 1, -1] if towards else normals
        return opencv @ np.array(self.pose(image)["camera_rt_matrix"])[:, :3]

    def scan_from_world(self, points, area):
        """World coordinates (..., 3) of an area in the frame of its scan, float64: where that is far from its origin, as in
        UTM, the world is the scan's frame less an offset."""
        offset = self.conventions["world"].get("offset_m", {}).get(str(area), [0, 0, 0])
        return np.asarray(points, np.float64) + offset

    def s3dis_rooms(self, area):
        """The folders of the rooms of an area in the S3DIS tree."""
        tree = self.root / "s3dis" / f"Area_{area}"
        return sorted(p for p in tree.glob("*") if p.is_dir()) if tree.is_dir() else []


# ---- The check --------------------------------------------------------------------------------------------------------


def check_image(data, image, fail):
    """Holds an image's files against each other."""
    there = {folder for folder in data.files if data.path(image, folder).exists()}
    seen = None
    if "pose" in there:
        pose = data.pose(image)
        turn = np.diag([1, -1, -1]) @ rotation(pose["final_camera_rotation"]).T
        RT, place = np.array(pose["camera_rt_matrix"]), np.array(pose["camera_location"])
        if np.abs(RT[:, :3] - turn).max() > 1e-6 or np.abs(RT[:, :3] @ place + RT[:, 3]).max() > 1e-4:
            fail(f"{image.stem}: camera_rt_matrix is not that of the angles and the location")
    if "depth" in there:
        seen = ~np.isnan(data.depth(image))
    if "semantic" in there:
        index = data.semantic(image)
        if index.max() >= len(data.labels):
            fail(f"{image.stem}: label {index.max()} of {len(data.labels)}")
        # Depth may be missing where it is too far; the other way round never.
        if seen is not None and (seen & (index < 0)).any():
            fail(f"{image.stem}: depth where semantics has nothing")
    if {"semantic", "semantic_class"} <= there:
        if (data.semantic_class(image) != data.class_of_label[data.semantic(image)]).any():
            fail(f"{image.stem}: classes that are not those of the labels")
    if {"semantic", "semantic_refined", "semantic_moved"} <= there:
        if ((data.semantic(image) != data.semantic_refined(image)) != data.semantic_moved(image)).any():
            fail(f"{image.stem}: moved labels that are not those that differ")
    if "mask_valid" in there:
        mask = data.mask_valid(image)
        if seen is not None and (seen & ~mask).any():
            fail(f"{image.stem}: depth where the mask has nothing")
        for folder in {"reshading", "segment_unsup2d", "segment_unsup25d"} & there:
            if ((read_png(data.path(image, folder)) > 0) != mask).any():
                fail(f"{image.stem}: {folder} disagrees with the mask")
    if {"edge_instance", "boundary_distance", "mask_valid"} <= there:
        zero = data.boundary_distance(image) == 0
        if (zero != (data.edge_instance(image) & mask)).any():
            fail(f"{image.stem}: borders are not at a distance of 0")
    if {"objects", "semantic"} <= there:
        index = data.semantic(image)
        objects = data.objects(image)
        if [thing["label_index"] for thing in objects] != [label for label in np.unique(index) if label > 0]:
            fail(f"{image.stem}: objects that are not those of the labels")
        for thing in objects:
            visible = index == thing["label_index"]
            amodal = decode_mask(thing["amodal_mask"])
            if visible.sum() != thing["visible_pixels"] or (visible & ~amodal).any():
                fail(f"{image.stem}: {thing['label']} has other pixels than its label")
    if "normal" in there and {"depth", "pose"} <= there:
        points, normals = data.world_points(image), data.world_normals(image)
        rays = points - np.array(data.pose(image)["camera_location"])
        away = np.sum(normals * rays, axis=-1) > 0.02 * np.linalg.norm(rays, axis=-1)
        if away[seen].any():
            fail(f"{image.stem}: {away[seen].sum()} normals point away from the camera")
    if {"depth", "pose", "global_xyz"} <= there:
        stored, points = data.xyz(image), data.world_points(image)
        both = seen & ~np.isnan(stored).any(axis=-1)
        if both.sum() < 0.999 * seen.sum():
            fail(f"{image.stem}: coordinates are missing where depth is not")
        rays = points - np.array(data.pose(image)["camera_location"])
        depth = data.depth(image)
        with np.errstate(invalid="ignore", divide="ignore"):
            # Half a step of depth, stretched to the ray; half a step of the stored number; and rounding.
            step = 0.5 / data.conventions["depth"]["units_per_m"]
            allowed = step * np.linalg.norm(rays, axis=-1) / np.maximum(depth, 1e-9)
        stored = np.where(both[..., None], stored, stored.dtype.type(0))
        allowed = allowed[..., None] + 0.5 * np.spacing(np.abs(stored)).astype(np.float64) + 1e-5
        off = np.abs(points - stored.astype(np.float64))
        if (off > allowed)[both].any():
            fail(f"{image.stem}: depth and coordinates are {off[both].max():.4f} m apart")
        return off[both].max() if both.any() else 0.0
    return None


def main():
    parser = argparse.ArgumentParser(description="Reads a data set and holds its files against each other.")
    parser.add_argument("out", help="the data set's folder")
    parser.add_argument("--images", type=int, default=8, help="how many panoramas and views of each area (default 8)")
    args = parser.parse_args()
    data, failures = Dataset(args.out), []
    for area in data.areas:
        for kind in ("pano", "data"):
            images = data.images(kind, [area])
            picked = [images[i] for i in np.unique(np.linspace(0, len(images) - 1, args.images).astype(int))] if images else []
            off = [d for d in (check_image(data, image, failures.append) for image in picked) if d is not None]
            text = f", depth and coordinates at most {max(off) * 1000:.1f} mm apart" if off else ""
            print(f"area {area} {kind}: {len(images)} images, {len(picked)} read{text}")
        for photograph in data.photographs(area):
            image = photograph["image"]
            if not any(data.path(image, folder).exists() for folder in data.files):
                failures.append(f"area {area}: the view of photograph {photograph['name']} is not there")
            elif data.path(image, "rgb").exists() and abs(1 - data.mask(image).mean() - photograph["masked"]) > 1e-6:
                failures.append(f"area {area}: frames.json tells of another mask of {photograph['name']}")
        folder = data.root / f"area_{area}" / "3d"
        name = "semantic.obj" if data.is_labelled else "rgb.obj"
        vertices, faces, materials = read_obj(folder / name)
        if len(faces) and faces.max() >= len(vertices):
            failures.append(f"area {area}: {name} has faces without vertices")
        if data.is_labelled and not set(materials) <= set(data.label_names):
            failures.append(f"area {area}: {name} has materials that are no labels")
        if (folder / "source_faces.npz").exists():
            source = read_source_faces(folder / "source_faces.npz")
            if len(source["face"]) != len(faces) or source["file"].max(initial=0) >= len(source["files"]):
                failures.append(f"area {area}: source_faces.npz has other faces than {name}")
        points = read_points(folder / "pointcloud.ply")
        if len(points) and points["label"].max() >= len(data.labels):
            failures.append(f"area {area}: pointcloud.ply has labels beyond the table")
        if data.is_labelled:
            votes = read_votes(folder / "votes.npz")
            if len(votes["label"]) != len(faces) or not set(votes["label"]) <= set(range(len(data.labels))):
                failures.append(f"area {area}: votes.npz has other faces or labels than semantic.obj")
        instances = read_instances(folder / "instances.npz") if data.is_labelled else []
        if any(i["counts"].sum() != len(i["points"]) for i in instances):
            failures.append(f"area {area}: instances.npz counts other points than it lists")
        rooms = data.s3dis_rooms(area)
        in_tree = sum(len(read_s3dis_room(room)[0]) for room in rooms)
        if in_tree != np.count_nonzero(points["label"]):
            failures.append(f"area {area}: {in_tree} points in the S3DIS tree, {np.count_nonzero(points['label'])} labelled")
        print(f"area {area}: {len(faces)} faces, {len(points)} points, {len(instances)} instances, {len(rooms)} rooms")
    for failure in failures:
        print("FAIL", failure)
    print("all as it should be" if not failures else f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
