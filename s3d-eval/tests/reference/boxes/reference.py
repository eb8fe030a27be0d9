"""Runs mmdetection3d's and Open3D-ML's scripts on cases.json: README.md says how.

reference.py FOLDER > reference.json, where FOLDER holds their files and iou.so.
"""
import ctypes
import importlib.util
import json
import sys
import types
import warnings

import numpy as np

FOLDER = sys.argv[1]
warnings.simplefilter("ignore")


class Tensor(np.ndarray):
    """As much of torch.Tensor as boxes without rotation need."""

    device = "cpu"
    numel = lambda self: np.ndarray.size.__get__(self)
    dim = lambda self: self.ndim
    size = lambda self, k: self.shape[k]
    clone = lambda self: self.copy()
    to = lambda self, *_: self
    view = lambda self, *shape: self.reshape(shape)
    new = lambda self, *shape: np.zeros(shape, np.float32).view(Tensor)
    new_tensor = lambda self, values: tensor(values)
    unsqueeze = lambda self, axis: np.expand_dims(self, axis)
    expand = lambda self, *shape: np.broadcast_to(self, shape)
    clamp = lambda self, min: np.maximum(self, np.float32(min))
    numpy = lambda self: np.asarray(self)


def tensor(values, dtype=np.float32, device=None):
    return np.ndarray.view(np.array(values, dtype), Tensor)


def zeros(shape, dtype=np.float32):
    return tensor(np.zeros(shape), dtype)


def box_iou_rotated(a, b):
    out = np.zeros((len(a), len(b)), np.float32)
    a, b = (np.ascontiguousarray(np.asarray(v), np.float32) for v in (a, b))
    pointer = lambda v: v.ctypes.data_as(ctypes.c_void_p)
    ctypes.CDLL(f"{FOLDER}/iou.so").ious(pointer(a), len(a), pointer(b), len(b), pointer(out))
    return tensor(out)


def module(name, **members):
    made = types.ModuleType(name)
    made.__dict__.update(members)
    made.__path__ = []
    sys.modules[name] = made
    return made


def load(name, file):
    spec = importlib.util.spec_from_file_location(name, f"{FOLDER}/{file}")
    made = importlib.util.module_from_spec(spec)
    sys.modules[name] = made
    spec.loader.exec_module(made)
    return made


module("torch", Tensor=Tensor, Size=tuple, device=str, as_tensor=tensor, zeros=zeros, float32=np.float32, max=np.maximum,
       min=np.minimum, clamp=lambda v, min: v.clamp(min))
module("mmcv")
module("mmcv.ops", box_iou_rotated=box_iou_rotated, points_in_boxes_all=None, points_in_boxes_part=None)
module("mmdet3d")
module("mmdet3d.structures")
module("mmdet3d.structures.points", BasePoints=None)
module("boxes")
module("boxes.utils", limit_period=None, rotation_3d_in_axis=None)
module("mmengine")
module("mmengine.logging", print_log=lambda *_, **__: None)
load("boxes.base_box3d", "base_box3d.py")
Boxes = load("boxes.depth_box3d", "depth_box3d.py").DepthInstance3DBoxes
# The mode of all boxes is the one that is asked for.
Boxes.convert_to = lambda self, mode: self
indoor = load("indoor_eval", "indoor_eval.py")

import open3d.ml.contrib as contrib

module("metrics", iou_bev=contrib.iou_bev_cpu, iou_3d=contrib.iou_3d_cpu)
open3d_ml = load("metrics.mAP", "mAP.py")

# numpy's default order of equal scores differs by processor: here it is theirs that came first.
argsort = np.argsort
np.argsort = lambda values: argsort(values, kind="stable")


def depth_boxes(boxes):
    """Bottom centre, size and a rotation of 0."""
    v = np.array(boxes, np.float64).reshape(-1, 6)
    low, high = v[:, :3], v[:, 3:]
    middle = (low + high) / 2
    rows = np.hstack([middle[:, :2], low[:, 2:], high - low, np.zeros((len(v), 1))])
    return Boxes(rows, box_dim=7, with_yaw=False)


def camera_boxes(boxes):
    """x, lower end, z of the middle and size, y up, as Open3D's boxes: y is where the box ends."""
    v = np.array(boxes, np.float64).reshape(-1, 6)
    low, high = v[:, :3], v[:, 3:]
    middle, size = (low + high) / 2, high - low
    columns = [middle[:, 0], high[:, 2], middle[:, 1], size[:, 0], size[:, 2], size[:, 1], np.zeros(len(v))]
    return np.stack(columns, axis=1).astype(np.float32)


def by_room(rows):
    rooms = 1 + max(row[0] for row in case["truth"] + case["detections"])
    return [[row for row in rows if row[0] == room] for room in range(rooms)]


def mmdetection3d(truth, found, classes):
    gt = [{"gt_bboxes_3d": depth_boxes([t[2] for t in room]), "gt_labels_3d": [t[1] for t in room]}
          for room in truth]
    dt = [{"bboxes_3d": depth_boxes([d[3] for d in room]), "labels_3d": tensor([d[1] for d in room], int),
           "scores_3d": tensor([d[2] for d in room])} for room in found]
    names = [str(c) for c in range(classes)]
    return indoor.indoor_eval(gt, dt, [0.25, 0.5], names, box_mode_3d="depth")


def open3d(truth, found, classes):
    target = [{"bbox": camera_boxes([t[2] for t in room]), "label": np.array([t[1] for t in room])}
              for room in truth]
    pred = [{"bbox": camera_boxes([d[3] for d in room]), "label": np.array([d[1] for d in room]),
             "score": np.array([d[2] for d in room])} for room in found]
    of = lambda iou: open3d_ml.mAP(pred, target, list(range(classes)), [0], [iou], bev=False)
    return {f"AP_{iou:.2f}": of(iou)[:, 0, 0].tolist() for iou in (0.25, 0.5)}


results = {}
for name, case in json.load(open("cases.json")).items():
    metres = lambda b: [v / 256 for v in b]
    truth = by_room([[r, c, metres(b)] for r, c, b in case["truth"]])
    found = by_room([[r, c, s / 4096, metres(b)] for r, c, s, b in case["detections"]])
    results[name] = {"mmdetection3d": mmdetection3d(truth, found, case["classes"]),
                     "open3d-ml": open3d(truth, found, case["classes"])}
text = json.dumps(results, separators=(",", ":")).replace("NaN", "null")
print(text.replace('},"', '},\n"'))
