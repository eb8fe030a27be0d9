"""Arguments of calls as arrays and numbers, or errors that say what was seen."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import UsageError


MOST_SEED = 2**64 - 1
"""The largest seed that Rust takes."""


def rows(what: str, values: npt.ArrayLike, columns: int, kind: Any) -> npt.NDArray[Any]:
    """Returns the values as an array (n, columns) of this type, in C order."""
    try:
        array = np.ascontiguousarray(values, kind)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{what}: {error}") from None
    if array.ndim != 2 or array.shape[1] != columns:
        raise UsageError(f"{what}: an array (n, {columns}), not of shape {array.shape}")
    return array


def whole(what: str, values: npt.ArrayLike, kind: Any) -> npt.NDArray[Any]:
    """Returns whole numbers as an array of this type, in C order."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise UsageError(f"{what}: whole numbers, not {_seen(array)}")
    limits = np.iinfo(kind)
    if array.size and (int(array.min()) < limits.min or int(array.max()) > limits.max):
        raise UsageError(f"{what}: numbers from {limits.min} to {limits.max}, not {_seen(array)}")
    return np.ascontiguousarray(array, kind)


def indices(what: str, values: npt.ArrayLike, columns: int) -> npt.NDArray[np.uint32]:
    """Returns the values as indices."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu" and array.size:
        raise UsageError(f"{what}: whole numbers, not {array.dtype}")
    if array.size and (array.min() < 0 or array.max() >= 2**32):
        raise UsageError(f"{what}: indices from 0, not {array.min()} to {array.max()}")
    return rows(what, array, columns, np.uint32)


def colors_of(values: npt.ArrayLike, what: str = "vertex_colors") -> npt.NDArray[np.uint8]:
    """Returns colours (n, 3), given as numbers from 0 to 255 or floats from 0 to 1, without their opacity."""
    array = _levels(what, values)
    if array.ndim == 2 and array.shape[1] == 4:
        array = array[:, :3]
    return rows(what, array, 3, np.uint8)


def image_of(what: str, values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Returns an image (H, W, 3), given like colours, without its opacity."""
    array = _levels(what, values)
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise UsageError(f"{what}: an image (H, W, 3), not an array of shape {array.shape}")
    return np.ascontiguousarray(array[:, :, :3])


def number(what: str, value: Any, least: int, most: int = 2**63 - 1) -> int:
    """Returns a whole number within a range."""
    try:
        found = operator.index(value)
    except TypeError:
        found = None
    if found is None or not least <= found <= most:
        upwards = "" if most == 2**63 - 1 else f" to {most}"
        raise UsageError(f"{what}={value!r}: must be a whole number from {least}{upwards}")
    return found


def _levels(what: str, values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Returns levels of colours from 0 to 255."""
    array = np.asarray(values)
    if array.dtype == np.uint8 or not array.size:
        return array.astype(np.uint8, copy=False)
    most = {"f": 1, "i": 255, "u": 255}.get(array.dtype.kind)
    # NaN is in no range.
    if most is None or not (array.min() >= 0 and array.max() <= most):
        raise UsageError(f"{what}: whole numbers from 0 to 255 or floats from 0 to 1, not {_seen(array)}")
    return np.rint(array * 255.0).astype(np.uint8) if most == 1 else array.astype(np.uint8)


def _seen(array: npt.NDArray[Any]) -> str:
    if array.dtype.kind not in "iuf" or not array.size:
        return str(array.dtype)
    return f"{array.dtype} from {array.min():g} to {array.max():g}"
