"""Writes cases.json: boxes and detections of a few classes in a few rooms, by case.

Coordinates are in steps of 1/256 m and scores in steps of 1/4096, which f32 holds exactly:
`[room, class, box]` and `[room, class, score, box]`. python3 generate.py > cases.json
"""
import json
import random

STEP = 256


def cell(v):
    return round(v * STEP) / STEP


def box(rng, flat=None):
    low = [rng.uniform(-3, 3) for _ in range(3)]
    size = [rng.uniform(0.25, 2) for _ in range(3)]
    if flat is not None:
        size[flat] = 0
    low = [cell(v) for v in low]
    return low + [cell(a + s) for a, s in zip(low, size)]


def moved(rng, b, by):
    low = [cell(v + rng.uniform(-by, by)) for v in b[:3]]
    return low + [max(a, cell(v + rng.uniform(-by, by))) for a, v in zip(low, b[3:])]


def rooms(seed, count, truth, classes, copies=2, by=0.4, missing=0.2, false=0.3, scores=4096, flat=()):
    """Truth and detections: copies of most boxes, moved, and boxes of nothing. `scores` different ones."""
    rng = random.Random(seed)
    case = {"classes": classes, "truth": [], "detections": []}
    score = lambda: rng.randrange(1, scores) / scores
    for room in range(count):
        found = []
        for _ in range(rng.randrange(truth + 1)):
            c = rng.randrange(classes)
            b = box(rng, rng.choice(flat) if flat and rng.random() < 0.5 else None)
            case["truth"].append([room, c, b])
            if rng.random() >= missing:
                for _ in range(rng.randrange(1, copies + 1)):
                    exact = rng.random() < 0.3
                    found.append([room, c, score(), b if exact else moved(rng, b, by * rng.random())])
            if rng.random() < false:
                found.append([room, rng.randrange(classes), score(), box(rng)])
        rng.shuffle(found)
        case["detections"] += found
    return case


def only(case, truth, detections):
    """The same, with the truth and the detections of these classes alone."""
    case["truth"] = [t for t in case["truth"] if t[1] in truth]
    case["detections"] = [d for d in case["detections"] if d[1] in detections]
    return case


def at_thresholds():
    """IoU of 1/2 and 1/4, and by one step more and less; of boxes that hold one another."""
    case = {"classes": 3, "truth": [], "detections": []}
    for room, (c, width) in enumerate([(0, 1.0), (0, 0.5), (1, 1 + 1 / STEP), (1, 0.5 + 1 / STEP),
                                       (2, 1 - 1 / STEP), (2, 0.5 - 1 / STEP)]):
        case["truth"].append([room, c, [-1.0, 0.0, 0.0, 1.0, 1.0, 1.0]])
        case["detections"].append([room, c, 0.5 + room / 16, [-1.0, 0.0, 0.0, width - 1, 1.0, 1.0]])
    return case


def nested(seed):
    """Boxes that overlap: several of the truth that one detection is near to."""
    rng = random.Random(seed)
    case = {"classes": 2, "truth": [], "detections": []}
    for room in range(6):
        for c in range(2):
            b = box(rng)
            for _ in range(4):
                case["truth"].append([room, c, moved(rng, b, 0.1)])
                case["detections"].append([room, c, rng.randrange(256) / 256, moved(rng, b, 0.1)])
    return case


def cases():
    yield "random 1", rooms(1, 7, 12, 5)
    yield "random 2", rooms(2, 7, 12, 5, by=0.2, missing=0.1)
    yield "random 3", rooms(3, 12, 20, 4, copies=1, by=0.3, missing=0.4, false=0.1)
    yield "many", rooms(4, 20, 30, 2, by=0.3)
    yield "ties", rooms(5, 6, 12, 3, scores=4)
    yield "duplicates", rooms(6, 6, 10, 3, copies=5, by=0.0)
    yield "absent class", only(rooms(7, 5, 10, 4), [0, 1], [0, 1])
    yield "missed class", only(rooms(8, 5, 10, 3), [0, 1, 2], [0, 2])
    yield "invented class", only(rooms(9, 5, 10, 3), [0, 2], [0, 1, 2])
    yield "no detections", only(rooms(10, 3, 8, 3), [0, 1, 2], [])
    yield "no truth", only(rooms(11, 3, 8, 3), [], [0, 1, 2])
    yield "empty rooms", rooms(12, 9, 2, 3, missing=0.3)
    yield "flat in x", rooms(13, 6, 10, 3, by=0.05, flat=[0])
    yield "flat in y", rooms(14, 6, 10, 3, by=0.05, flat=[1])
    yield "flat in z", rooms(15, 6, 10, 3, by=0.05, flat=[2])
    yield "at thresholds", at_thresholds()
    yield "overlapping", nested(16)


def steps(row):
    *head, b = row
    return head[:2] + [round(4096 * score) for score in head[2:]] + [[round(STEP * v) for v in b]]


if __name__ == "__main__":
    lines = []
    for name, case in cases():
        case["truth"] = [steps(t) for t in case["truth"]]
        case["detections"] = [steps(d) for d in case["detections"]]
        lines.append(f"{json.dumps(name)}: {json.dumps(case, separators=(',', ':'))}")
    print("{" + ",\n".join(lines) + "}")
