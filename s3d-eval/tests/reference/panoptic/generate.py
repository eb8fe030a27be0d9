"""Writes cases.json: small images of segments, true and predicted, by case. python3 generate.py > cases.json

A side of an image is `[pixels, segments]`: numbers of segments row by row, 0 being void, and `[number, class]`.
"""
import json
import random

WIDTH, HEIGHT = 16, 12
CLASSES = 5
STUFF = [3, 4]


def side(pixels, classes):
    return [pixels, [[id, classes[id]] for id in sorted(set(pixels) - {0})]]


def rectangle(rng):
    x, y = rng.randrange(WIDTH), rng.randrange(HEIGHT)
    return x, y, min(WIDTH, x + rng.randrange(2, 9)), min(HEIGHT, y + rng.randrange(2, 8))


def paint(rectangles, background):
    pixels = [background] * (WIDTH * HEIGHT)
    for id, (x0, y0, x1, y1) in rectangles:
        for y in range(y0, y1):
            pixels[y * WIDTH + x0:y * WIDTH + x1] = [id] * (x1 - x0)
    return pixels


def moved(rng, rectangle, by):
    x0, y0, x1, y1 = (v + rng.randrange(-by, by + 1) for v in rectangle)
    x0, y0 = max(0, min(x0, WIDTH - 1)), max(0, min(y0, HEIGHT - 1))
    return x0, y0, max(x0 + 1, min(x1, WIDTH)), max(y0 + 1, min(y1, HEIGHT))


def image(rng, by, classes=range(CLASSES), void=0.3, wrong=0.2, missing=0.2):
    """Rectangles that hide one another, and predictions of most of them under other numbers."""
    truth = [(id, rectangle(rng)) for id in range(1, rng.randrange(3, 9))]
    of = {id: rng.choice(classes) for id, _ in truth}
    of[50] = rng.choice(classes)
    background = 0 if rng.random() < void else 50
    found, found_of = [], {}
    for id, r in truth:
        if rng.random() >= missing:
            found.append((id + 100, moved(rng, r, by)))
            found_of[id + 100] = rng.choice(classes) if rng.random() < wrong else of[id]
    found_of[200] = of[50]
    behind = rng.choice([0, 200])
    return [side(paint(truth, background), of), side(paint(found, behind), found_of)]


def row(truth, predicted, of, found_of):
    """An image of one row, of runs `(number, length)`."""
    spread = lambda runs: [id for id, count in runs for _ in range(count)]
    return [side(spread(truth), of), side(spread(predicted), found_of)]


def cases():
    many = lambda seed, count, **how: [image(random.Random(f"{seed} {i}"), **how) for i in range(count)]
    yield "random", many(1, 12, by=1)
    yield "far", many(2, 8, by=3)
    yield "exact", many(3, 4, by=0, wrong=0, missing=0)
    yield "much void", many(4, 8, by=2, void=1.0)
    yield "things alone", many(5, 6, by=1, classes=[0, 2])
    yield "stuff alone", many(6, 6, by=1, classes=[3])
    yield "IoU of 1/2", [row([(1, 4), (0, 4)], [(5, 2), (0, 6)], {1: 0}, {5: 0}),
                         row([(1, 4), (2, 5)], [(5, 3), (6, 6)], {1: 0, 2: 1}, {5: 0, 6: 1}),
                         row([(1, 3), (2, 6)], [(5, 6), (6, 3)], {1: 3, 2: 3}, {5: 3, 6: 4})]
    yield "half void", [row([(0, 4), (1, 4)], [(5, 6), (0, 2)], {1: 0}, {5: 1}),
                        row([(0, 4), (1, 4)], [(0, 1), (5, 6), (0, 1)], {1: 0}, {5: 1}),
                        row([(0, 4), (1, 4)], [(0, 1), (5, 5), (6, 2)], {1: 0}, {5: 0, 6: 0})]
    yield "all void", [row([(0, 8)], [(5, 4), (0, 4)], {}, {5: 1}), row([(0, 8)], [(0, 8)], {}, {})]
    yield "no prediction", [row([(1, 4), (2, 4)], [(0, 8)], {1: 0, 2: 3}, {})]
    yield "other class", [row([(1, 8)], [(5, 8)], {1: 0}, {5: 3})]


if __name__ == "__main__":
    lines = (f"{json.dumps(name)}: {json.dumps(of, separators=(',', ':'))}" for name, of in cases())
    print("{" + ",\n".join(lines) + "}")
