"""Writes cases.json: rooms whose points come in runs, [class, instance, count] of the truth and [class, count] or
[instance, count] of predictions, and masks as ranges of points. Usage: python generate.py"""

import json

import numpy as np

rng = np.random.default_rng(18)


def runs(values):
    values = np.asarray(values)
    starts = np.flatnonzero(np.r_[True, np.any(values[1:] != values[:-1], axis=tuple(range(1, values.ndim)))])
    ends = np.r_[starts[1:], len(values)]
    return [[*map(int, np.atleast_1d(values[s])), int(e - s)] for s, e in zip(starts, ends)]


def random_truth(instances, sizes, classes, void=0.0):
    """Runs of the truth, an instance each."""
    return [
        [-1 if rng.random() < void else int(rng.choice(classes)), at, int(rng.integers(*sizes))]
        for at in range(instances)
    ]


def expand(truth):
    return np.repeat([t[:2] for t in truth], [t[2] for t in truth], axis=0).reshape(-1, 2)


def semantic(truth, classes, wrong):
    points = expand(truth)[:, 0].copy()
    points[points < 0] = 0
    at = 0
    while at < len(points):
        n = int(rng.integers(5, 60))
        if rng.random() < wrong:
            points[at : at + n] = rng.choice(classes)
        at += n
    return runs(points[:, None]) if len(points) else []


def sem3d():
    everything, few = list(range(13)), [0, 1, 2, 5, 8]
    cases = {
        "random with void": [random_truth(30, (5, 90), everything, 0.1) for _ in range(3)],
        "absent classes": [random_truth(12, (5, 90), few) for _ in range(2)],
        "all void": [random_truth(5, (5, 40), few, 1.0)],
        "an empty room": [[], random_truth(10, (5, 50), everything)],
    }
    made = {
        name: [{"truth": t, "predicted": semantic(t, everything if "void" in name else few + [11], 0.4)} for t in rooms]
        for name, rooms in cases.items()
    }
    truth = random_truth(20, (5, 60), everything)
    right = [[c, n] for c, _, n in truth]
    made["perfect"] = [{"truth": truth, "predicted": right}]
    return made


def shifted(start, end, total):
    """A range near another."""
    size = end - start
    by = int(size * rng.choice([0.0, 0.02, 0.1, 0.2, 0.35, 0.5]) * rng.choice([-1, 1]))
    grow = int(size * rng.choice([0.0, 0.05, 0.2]))
    return [max(0, start + by), min(total, end + by + grow)]


def masks_of(truth, classes, extra):
    total, at, masks = sum(t[2] for t in truth), 0, []
    for label, _, n in truth:
        for _ in range(int(rng.integers(0, 3))):
            wrong = label < 0 or rng.random() < 0.15
            masks.append(
                {
                    "class": int(rng.choice(classes)) if wrong else label,
                    "score": round(float(rng.random()), 1),
                    "ranges": [shifted(at, at + n, total)],
                }
            )
        at += n
    for _ in range(extra):
        a = int(rng.integers(0, max(total - 90, 1)))
        b = min(total, a + int(rng.integers(50, 400)))
        masks.append(
            {"class": int(rng.choice(classes)), "score": round(float(rng.random()), 1), "ranges": [[a, b]]}
        )
    order = rng.permutation(len(masks))
    return [masks[i] for i in order]


def mask(label, score, *ranges):
    return {"class": label, "score": score, "ranges": [list(r) for r in ranges]}


def inst_ap():
    everything, few = list(range(13)), [2, 7, 8]
    random = [random_truth(25, (40, 400), few, 0.15) for _ in range(4)]
    many = [random_truth(60, (60, 300), everything, 0.05) for _ in range(3)]
    at_thresholds, start = [], 0
    truth = []
    # IoU of n / 1000, as exactly as floats allow.
    for i, n in enumerate([500, 550, 600, 650, 700, 750, 800, 850, 900, 250, 501, 251]):
        truth.append([8, i, 1000])
        at_thresholds.append(mask(8, 0.05 * (i + 1), (start, start + n)))
        start += 1000
    made = {
        "random with void and ties": [{"truth": t, "masks": masks_of(t, few + [11], 6)} for t in random],
        "all classes": [{"truth": t, "masks": masks_of(t, everything, 20)} for t in many],
        "IoU at the thresholds": [{"truth": truth, "masks": at_thresholds}],
        "duplicates and ties": [
            {
                "truth": [[8, 0, 200], [8, 1, 150], [7, 2, 300]],
                "masks": [
                    mask(8, 0.5, (0, 200)),
                    mask(8, 0.9, (0, 190)),
                    mask(8, 0.5, (5, 200)),
                    mask(8, 0.5, (200, 350)),
                    mask(7, 0.7, (350, 640)),
                    mask(7, 0.7, (350, 650)),
                    mask(7, 0.1, (0, 100)),
                ],
            }
        ],
        "one prediction over two instances": [
            {
                "truth": [[8, 0, 200], [8, 1, 200], [8, 2, 60]],
                "masks": [
                    mask(8, 0.9, (0, 400)),
                    mask(8, 0.8, (150, 400)),
                    mask(8, 0.7, (0, 210)),
                    mask(8, 0.6, (50, 460)),
                    mask(8, 0.4, (390, 460), (0, 40)),
                ],
            }
        ],
        "absent class, empty room, no prediction": [
            {"truth": [[8, 0, 150], [7, 1, 120]], "masks": [mask(11, 0.9, (0, 150)), mask(8, 0.2, (0, 140))]},
            {"truth": [], "masks": []},
            {"truth": [[3, 0, 500], [8, 1, 99], [5, 2, 100]], "masks": []},
            {"truth": [[5, 0, 100]], "masks": [mask(5, 0.3, (0, 99)), mask(5, 0.3, (0, 100))]},
        ],
        "all void": [{"truth": [[-1, 0, 400]], "masks": [mask(8, 0.9, (0, 300)), mask(7, 0.3, (100, 200))]}],
        "all predictions ignored": [
            {
                "truth": [[8, 0, 200], [-1, 1, 300], [8, 2, 80]],
                "masks": [mask(8, 0.9, (200, 500)), mask(8, 0.8, (400, 580)), mask(8, 0.3, (380, 520))],
            }
        ],
    }
    return made


def segments(truth, classes):
    """Predicted instances, an instance a point, and their classes a point."""
    points = expand(truth)
    instance, label = points[:, 1].copy(), points[:, 0].copy()
    at = 0
    while at < len(points):
        n = int(rng.integers(5, 80))
        kind = rng.random()
        if kind < 0.15:
            instance[at : at + n] = rng.integers(-1, len(truth) + 4)
        elif kind < 0.25:
            label[at : at + n] = rng.choice(classes)
        at += n
    return runs(instance[:, None]), runs(label[:, None])


def room(truth, instances, classes):
    return {"truth": truth, "instances": instances, "classes": classes}


def inst_cov():
    everything, few = list(range(13)), [0, 2, 8]
    rooms = [random_truth(40, (20, 200), everything) for _ in range(3)]
    return {
        "random": [room(t, *segments(t, everything)) for t in rooms],
        "absent classes": [room(t, *segments(t, few + [11])) for t in [random_truth(15, (20, 200), few) for _ in range(2)]],
        # IoU of one half, twice for one instance; the class of half of an instance's points; no instance.
        "IoU of one half, ties, none": [
            room([[8, 0, 200], [7, 1, 100]], [[0, 100], [1, 100], [2, 50], [3, 50]], [[8, 200], [7, 50], [9, 50]]),
            room([[8, 0, 100], [2, 1, 60]], [[5, 160]], [[8, 80], [2, 80]]),
            room([[3, 0, 40], [3, 1, 60]], [[-1, 100]], [[3, 100]]),
        ],
    }


json.dump(
    {"sem3d": sem3d(), "inst-ap": inst_ap(), "inst-cov": inst_cov()},
    open("cases.json", "w"),
    separators=(",", ":"),
)
