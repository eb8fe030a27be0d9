"""Segments of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import s3d_py as s3d


def test_segments_follow_the_sides_of_a_room(room: s3d.Mesh) -> None:
    found = s3d.segments(room)
    assert found.of_face.shape == (14,) and len(found) == found.of_face.max() + 1
    assert repr(found) == f"Segments({len(found)} segments of 14 faces)"
    # Faces of one segment have one normal: the room has flat sides.
    for segment in range(len(found)):
        normals = room.face_normals[found.of_face == segment]
        assert np.allclose(normals, normals[0], atol=1e-6)
    for threads in (1, 3):
        assert np.array_equal(s3d.segments(room, threads=threads).of_face, found.of_face)


def test_the_tree_joins_segments(room: s3d.Mesh) -> None:
    found = s3d.segments(room)
    count = len(found)
    assert found.children.shape == (len(found.cost), 2)
    assert (found.children < count + np.arange(len(found.cost))[:, None]).all()
    assert np.array_equal(found.at(-1.0), found.of_face)
    whole = found.at(np.inf)
    assert len(np.unique(whole)) == count - len(found.cost)
    # One merge alone.
    first = found.at(float(found.cost.min()))
    merged = np.unique(first[first >= count])
    assert len(merged) >= 1
    for node in merged:
        assert len(np.unique(found.of_face[first == node])) >= 2


@pytest.mark.parametrize(
    "wrong",
    [{"scale_m2": 0.0}, {"scale_m2": np.nan}, {"smallest_m2": -1.0}, {"color": np.inf}],
)
def test_wrong_values_are_named(room: s3d.Mesh, wrong: dict[str, Any]) -> None:
    with pytest.raises(s3d.UsageError, match=next(iter(wrong))):
        s3d.segments(room, **wrong)
