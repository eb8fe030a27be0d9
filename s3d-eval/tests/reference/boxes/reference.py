"""Runs mmdetection3d's and Open3D-ML's scripts on cases.json: README.md says how.

reference.py FOLDER > reference.json, where FOLDER holds their files and iou.so.
"""
import json

import numpy as np

import mmdetection3d
from mmdetection3d import load, module

import open3d.ml.contrib as contrib

module("metrics", iou_bev=contrib.iou_bev_cpu, iou_3d=contrib.iou_3d_cpu)
open3d_ml = load("metrics.mAP", "mAP.py")


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
    results[name] = {"mmdetection3d": mmdetection3d.evaluate(truth, found, [str(c) for c in range(case["classes"])]),
                     "open3d-ml": open3d(truth, found, case["classes"])}
text = json.dumps(results, separators=(",", ":")).replace("NaN", "null")
print(text.replace('},"', '},\n"'))
