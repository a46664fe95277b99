"""The figures that there are: the modules of this folder whose names begin with `fig` and a number."""

from __future__ import annotations

import importlib
import pkgutil
import re
from types import ModuleType

import icha.figures
from icha.figures.declaration import Declaration

_NUMBERED = re.compile(r"fig(\d+)_")


def figure_number(name: str) -> int:
    """The number of a figure, which it has everywhere: that in its name."""
    return int(_NUMBERED.match(name)[1])


def _names() -> list[str]:
    names = [module.name for module in pkgutil.iter_modules(icha.figures.__path__) if _NUMBERED.match(module.name)]
    return sorted(names, key=lambda name: (figure_number(name), name))


def figure_module(name: str) -> ModuleType:
    """The module of a figure: its function `figure` draws it."""
    return importlib.import_module(f"icha.figures.{name}")


# By name, in the order of their numbers.
DECLARATIONS: dict[str, Declaration] = {name: figure_module(name).DECLARATION for name in _names()}
