"""Packages that users install themselves."""

from __future__ import annotations

import importlib
from typing import Any

from ._errors import UsageError


def package(name: str, install: str) -> Any:
    """Imports a package. `UsageError` says how to install it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(f"{name} cannot be imported ({error}): pip install {install}") from None
