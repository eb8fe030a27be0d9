"""Smooth walks through rooms and doors, as cameras."""

from __future__ import annotations

import heapq

import numpy as np

from ._camera import Matrix
from ._checks import number
from ._errors import InputError
from ._rendered import Camera, FreeSpace, looking
from ._scene import Scene

_NEAR_M = 1.2
"""Places are joined to others within this distance."""


def walk(
    scene: Scene,
    frames: int,
    *,
    speed: float = 1.0,
    rate: float = 30.0,
    height: float = 1.5,
    clear: float = 0.25,
    fov: float = 75.0,
    seed: int = 0,
) -> list[Camera]:
    """Returns the cameras of somebody who walks through rooms and their doors: `rate` a second at `speed` metres a
    second, `height` metres above what is below, looking where they go. Nothing comes nearer than half of `clear`
    metres. `RenderedViews(…, sampler=walk(…))` renders them in their order.

    Raises `InputError` if there is no way of a few metres.
    """
    frames, seed = number("frames", frames, 1), number("seed", seed, 0)
    rng = np.random.default_rng(seed)
    places = _places(scene, rng, height, clear)
    ways = _ways(scene, places, clear)
    step = speed / rate
    corners = _route(ways, places, rng, frames * step)
    along = _resampled(places[corners], step, frames)

    eyes = _smoothed(along, 0.3 / step)
    # Where a bend was cut too close, the straight way stays.
    close = _nearest(scene, eyes) < 0.5 * clear
    eyes[close] = along[close]
    ahead = np.gradient(_smoothed(along, 1.0 / step), axis=0) if frames > 1 else np.array([[1.0, 0, 0]])
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    return [Camera(looking(eye, turn, 0.0), fov) for eye, turn in zip(eyes, yaw)]


def _places(scene: Scene, rng: np.random.Generator, height: float, clear: float) -> Matrix:
    """Free places (N, 3) at a height above what is below them, two or three a square metre."""
    low, high = scene.mesh.bounds.astype(np.float64)
    space = FreeSpace(clear=clear, height=(0.8 * height, 1.2 * height))
    levels = max(1, round((high[2] - low[2]) / 3.0))
    count = int(min(6000, 3 * levels * (high[0] - low[0]) * (high[1] - low[1]) + 200))
    drawn = rng.uniform(low, high, (count, 3))
    below = scene.cast(drawn, np.tile([0.0, 0.0, -1.0], (count, 1)), threads=1)
    drawn[:, 2] = below.xyz[:, 2] + height
    free = [eye for eye in drawn[~np.isnan(drawn[:, 2])] if space.is_free(scene, eye)]
    if len(free) < 2:
        raise InputError(f"no place is free {height} m above a floor: is the mesh closed, Z up, in metres?")
    return np.array(free)


def _ways(scene: Scene, places: Matrix, clear: float) -> list[list[tuple[int, float]]]:
    """Of each place the others that are near, and their distances, where nothing is between."""
    ways: list[list[tuple[int, float]]] = [[] for _ in places]
    # Row by row: all distances at once would take memory.
    near = [
        i + 1 + np.flatnonzero(np.linalg.norm(places[i + 1 :] - place, axis=1) < _NEAR_M)
        for i, place in enumerate(places)
    ]
    first, second = np.repeat(np.arange(len(places)), [len(others) for others in near]), np.concatenate(near)
    offset = places[second] - places[first]
    length = np.linalg.norm(offset, axis=1)
    across = np.cross(offset, [0.0, 0.0, 1.0])
    across *= 0.5 * clear / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    free = np.abs(offset[:, 2]) < 0.3
    for side in (-1.0, 0.0, 1.0):
        free &= ~scene.test_occlusions(places[first] + side * across, offset, before=1.0, threads=1)
    for a, b, metres in zip(first[free].tolist(), second[free].tolist(), length[free].tolist()):
        ways[a].append((b, metres))
        ways[b].append((a, metres))
    return ways


def _route(
    ways: list[list[tuple[int, float]]], places: Matrix, rng: np.random.Generator, least_m: float
) -> list[int]:
    """Places in a row: from any to any that can be reached, again and again, until it is long enough."""
    reached = max((_distances(ways, start)[0] for start in range(0, len(ways), max(1, len(ways) // 20))), key=len)
    if len(reached) < 2:
        raise InputError("no place can be reached from another one: are there floors between walls?")
    among = sorted(reached)
    route = [among[int(rng.integers(len(among)))]]
    walked = 0.0
    while walked < least_m or len(route) < 2:
        found, before = _distances(ways, route[-1])
        # The farthest of a few, so that walks go through doors.
        goals = [among[int(i)] for i in rng.integers(len(among), size=4)]
        goal = max(goals, key=lambda place: found.get(place, 0.0))
        leg = [goal]
        while leg[-1] != route[-1]:
            leg.append(before[leg[-1]])
        route.extend(reversed(leg[:-1]))
        walked += found[goal]
    return route


def _distances(ways: list[list[tuple[int, float]]], start: int) -> tuple[dict[int, float], dict[int, int]]:
    """The length of the shortest way to each place that can be reached, and the place before it (Dijkstra 1959)."""
    found: dict[int, float] = {}
    before = {start: start}
    waiting = [(0.0, start, start)]
    while waiting:
        length, place, last = heapq.heappop(waiting)
        if place in found:
            continue
        found[place], before[place] = length, last
        for other, more in ways[place]:
            if other not in found:
                heapq.heappush(waiting, (length + more, other, place))
    return found, before


def _resampled(corners: Matrix, step: float, count: int) -> Matrix:
    """Points (count, 3) along a polyline, a step apart."""
    lengths = np.append(0.0, np.linalg.norm(np.diff(corners, axis=0), axis=1).cumsum())
    at = np.minimum(step * np.arange(count), lengths[-1])
    return np.stack([np.interp(at, lengths, corners[:, k]) for k in range(3)], axis=1)


def _smoothed(points: Matrix, sigma: float) -> Matrix:
    """Means of points (N, 3) with those around them, weighted by a bell of this width; ends stay."""
    reach = max(1, int(3 * sigma))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(sigma, 1e-9)) ** 2)
    padded = np.vstack([points[:1].repeat(reach, 0), points, points[-1:].repeat(reach, 0)])
    means = [np.convolve(padded[:, k], weights / weights.sum(), "valid") for k in range(3)]
    return np.stack(means, axis=1).astype(np.float64)


def _nearest(scene: Scene, eyes: Matrix) -> Matrix:
    """The distance of what is nearest to each position, by rays to all sides."""
    turn = np.arange(16) * np.pi / 8
    around = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    rays = scene.cast(eyes.repeat(16, 0), np.tile(around, (len(eyes), 1)), threads=1)
    nearest: Matrix = np.nan_to_num(rays.t, nan=np.inf).reshape(-1, 16).min(axis=1)
    return nearest
