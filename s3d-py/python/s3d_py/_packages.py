"""Packages that users install themselves."""

from __future__ import annotations

import importlib
from typing import Any, TypeVar

from ._errors import UsageError

T = TypeVar("T")


def package(name: str, install: str) -> Any:
    """Imports a package. `UsageError` says how to install it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(f"{name} cannot be imported ({error}): pip install {install}") from None


def for_torch(kind: type[T], base: str) -> type[T]:
    """Returns the class, which is a class of `torch.utils.data` as well if torch is installed."""
    try:
        torch_base = getattr(importlib.import_module("torch.utils.data"), base)
    except ImportError:
        return kind
    return type(kind.__name__, (kind, torch_base), {"__module__": kind.__module__})
