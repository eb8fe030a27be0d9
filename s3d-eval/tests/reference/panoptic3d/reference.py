"""Writes cases.json, and the numbers of semantic-kitti-api's script for them; see README.md. Usage: python reference.py REPOS"""

import importlib.util
import json
import os
import sys

import numpy as np

CLASSES, STUFF = 13, [0, 1, 2]
rng = np.random.default_rng(21)
path = os.path.join(sys.argv[1], "semantic-kitti-api/auxiliary/eval_np.py")
spec = importlib.util.spec_from_file_location("eval_np", path)
eval_np = importlib.util.module_from_spec(spec)
spec.loader.exec_module(eval_np)


def runs(points):
    points = np.asarray(points)
    starts = np.flatnonzero(np.r_[True, np.any(points[1:] != points[:-1], axis=1)]) if len(points) else []
    return [[*map(int, points[a]), int(b - a)] for a, b in zip(starts, [*starts[1:], len(points)])]


def truth_of(instances, classes):
    return [[int(rng.choice(classes)), at, int(rng.integers(1, 200))] for at in range(instances)]


def predicted_of(truth, classes, wrong):
    """Points with shifted borders, other classes, no instance, no class; each instance has one class."""
    points = np.repeat([t[:2] for t in truth], [t[2] for t in truth], axis=0)
    instance = np.roll(points[:, 1], int(rng.integers(-15, 15)))
    of_instance = np.array([c if rng.random() > wrong else int(rng.choice(classes)) for c, _, _ in truth])
    merged = rng.random(len(truth)) < 0.15
    instance = np.where(merged[instance], np.maximum(instance - 1, 0), instance)
    label = of_instance[instance]
    at = 0
    while at < len(points):
        n = int(rng.integers(5, 120))
        kind = rng.random()
        if kind < 0.1:
            instance[at : at + n] = -1
        elif kind < 0.2:
            label[at : at + n] = int(rng.choice(STUFF))
            instance[at : at + n] = 100 + label[at]
        elif kind < 0.25:
            label[at : at + n] = -1
        at += n
    return np.c_[label, instance]


def room(truth, predicted):
    return {"truth": truth, "predicted": runs(predicted)}


def segments(points, stuff):
    """The class and the instance that the script gets: a stuff class is one instance, 13 is no segment."""
    label, instance = np.asarray(points, dtype=np.int64).reshape(-1, 2).T
    is_stuff = np.isin(label, stuff)
    none = (label < 0) | (~is_stuff & (instance < 0))
    return np.where(none, CLASSES, label), np.where(is_stuff | none, 0, instance + 1)


def expand(runs):
    return np.repeat([r[:2] for r in runs], [r[2] for r in runs], axis=0) if runs else np.zeros((0, 2), int)


def score(rooms, stuff):
    evaluator = eval_np.PanopticEval(CLASSES + 1, ignore=[CLASSES], min_points=1)
    for of in rooms:
        evaluator.addBatchPanoptic(*segments(expand(of["predicted"]), stuff), *segments(expand(of["truth"]), stuff))
    counts = [evaluator.pan_tp, evaluator.pan_fp, evaluator.pan_fn]
    seen = np.sum(counts, axis=0)[:CLASSES] > 0
    scores = np.array(evaluator.getPQ()[3:])[:, :CLASSES]
    scores[:, ~seen] = np.nan
    is_stuff = np.isin(range(CLASSES), stuff)

    def mean(columns):
        left = scores[:, columns & seen]
        return left.mean(axis=1) if left.size else np.full(3, np.nan)

    return {
        "counts": np.array(counts)[:, :CLASSES].T.tolist(),
        "classes": [[None if np.isnan(v) else v for v in row] for row in scores.T.tolist()],
        "means": [
            [None if np.isnan(v) else v for v in mean(columns)] for columns in [~is_stuff, is_stuff, is_stuff | True]
        ],
    }


everything, few = list(range(CLASSES)), [0, 2, 7, 8]
cases = {}
for name, classes, wrong in [("all classes", everything, 0.2), ("absent classes", few, 0.1), ("mostly wrong", few, 0.8)]:
    rooms = []
    for _ in range(4):
        truth = truth_of(30, classes)
        rooms.append(room(truth, predicted_of(truth, classes + [11], wrong)))
    cases[name] = rooms
# An IoU of one half, and a point more; a predicted instance over two; nothing predicted; only predicted.
cases["thresholds"] = [
    room([[8, 0, 100], [8, 1, 100], [7, 2, 100]], [[8, 0]] * 50 + [[-1, -1]] * 50 + [[8, 1]] * 51 + [[7, 9]] * 149),
    room([[0, 0, 10], [0, 1, 10], [2, 2, 10]], [[0, 5]] * 15 + [[2, 6]] * 15),
    room([[12, 0, 40]], [[-1, -1]] * 40),
    room([[1, 0, 40]], [[9, 3]] * 40),
]
cases["perfect"] = [room(t, expand(t)) for t in [truth_of(20, everything), truth_of(5, few)]]

json.dump(cases, open("cases.json", "w"), separators=(",", ":"))
expected = {name: {"stuff": score(rooms, STUFF), "none": score(rooms, [])} for name, rooms in cases.items()}
json.dump(expected, open("expected.json", "w"), separators=(",", ":"))
