"""The figures that there are: the modules of this folder whose names begin with `fig` and a number."""

from __future__ import annotations

import importlib
import pkgutil
import re
from types import ModuleType

import icha.figures
from icha.figures.declaration import Declaration


def _names() -> list[str]:
    matches = (re.match(r"fig(\d+)_", module.name) for module in pkgutil.iter_modules(icha.figures.__path__))
    return [match.string for match in sorted(filter(None, matches), key=lambda match: (int(match[1]), match.string))]


def figure_module(name: str) -> ModuleType:
    """The module of a figure: its function `figure` draws it."""
    return importlib.import_module(f"icha.figures.{name}")


# By name, in the order of their numbers.
DECLARATIONS: dict[str, Declaration] = {name: figure_module(name).DECLARATION for name in _names()}
