"""Runs panopticapi on cases.json: reference.py FOLDER > reference.json, where FOLDER holds its package."""
import contextlib
import json
import os
import sys
import tempfile

import numpy as np
from PIL import Image

sys.path.insert(0, sys.argv[1])
from panopticapi.evaluation import pq_compute_multi_core

from generate import CLASSES, STUFF

CATEGORIES = {c + 1: {"id": c + 1, "isthing": int(c not in STUFF)} for c in range(CLASSES)}


def annotation(folder, i, side):
    pixels, segments = side
    ids = np.array(pixels, np.uint32).reshape(-1, 16 if len(pixels) == 192 else len(pixels))
    rgb = np.stack([ids % 256, ids // 256 % 256, ids // 65536], axis=2).astype(np.uint8)
    os.makedirs(folder, exist_ok=True)
    Image.fromarray(rgb).save(f"{folder}/{i}.png")
    info = [{"id": id, "category_id": c + 1, "area": pixels.count(id), "iscrowd": 0} for id, c in segments]
    return {"image_id": i, "file_name": f"{i}.png", "segments_info": info}


def averages(stat, isthing):
    try:
        return stat.pq_average(CATEGORIES, isthing)
    except ZeroDivisionError:
        return None, None


results = {}
for name, images in json.load(open("cases.json")).items():
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
        gt, pred = f"{folder}/gt", f"{folder}/pred"
        pairs = [(annotation(gt, i, truth), annotation(pred, i, found))
                 for i, (truth, found) in enumerate(images)]
        stat = pq_compute_multi_core(pairs, gt, pred, CATEGORIES)
    counts = [stat[c] for c in CATEGORIES]
    results[name] = {
        "all": averages(stat, None)[0], "things": averages(stat, True)[0], "stuff": averages(stat, False)[0],
        "classes": [[c.tp, c.fp, c.fn, float(c.iou)] for c in counts],
        "scores": list((averages(stat, None)[1] or {}).values()),
    }
text = json.dumps(results, separators=(",", ":"), default=float)
print(text.replace('},"', '},\n"'))
