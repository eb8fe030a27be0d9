"""mmdetection3d's `indoor_eval` with numpy in the place of torch: README.md says from which files."""
import ctypes
import importlib.util
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
# Every box is already in the requested mode.
Boxes.convert_to = lambda self, mode: self
indoor = load("indoor_eval", "indoor_eval.py")

# numpy's default order of equal scores depends on the processor; here the first of equal scores stays first.
argsort = np.argsort
np.argsort = lambda values: argsort(values, kind="stable")


def depth_boxes(boxes):
    """Bottom centre, size and a rotation of 0."""
    v = np.array(boxes, np.float64).reshape(-1, 6)
    low, high = v[:, :3], v[:, 3:]
    middle = (low + high) / 2
    rows = np.hstack([middle[:, :2], low[:, 2:], high - low, np.zeros((len(v), 1))])
    return Boxes(rows, box_dim=7, with_yaw=False)


def evaluate(truth, found, names):
    """truth: by room, [room, class, box]; found: by room, [room, class, score, box]."""
    gt = [{"gt_bboxes_3d": depth_boxes([t[2] for t in room]), "gt_labels_3d": [t[1] for t in room]}
          for room in truth]
    dt = [{"bboxes_3d": depth_boxes([d[3] for d in room]), "labels_3d": tensor([d[1] for d in room], int),
           "scores_3d": tensor([d[2] for d in room])} for room in found]
    return indoor.indoor_eval(gt, dt, [0.25, 0.5], names, box_mode_3d="depth")
