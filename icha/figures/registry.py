"""Find and draw the figures; each figure is a module of this folder whose name begins with `fig` and a number."""

from __future__ import annotations

import importlib
import os
import pkgutil
import re
import textwrap
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any

import icha.figures
from icha.figures.declaration import Declaration
from icha.figures.style import GREY, in_style, new_figure, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NUMBERED = re.compile(r"fig(\d+)_")


def figure_number(name: str) -> int:
    """Return the number in the name of a figure."""
    return int(_NUMBERED.match(name)[1])


def figure_module(name: str) -> ModuleType:
    """Import the module of a figure and return it."""
    return importlib.import_module(f"icha.figures.{name}")


_MODULES = (module.name for module in pkgutil.iter_modules(icha.figures.__path__))
_NAMES = sorted(filter(_NUMBERED.match, _MODULES), key=figure_number)
# Declarations by the name of the figure, in the order of the numbers.
DECLARATIONS: dict[str, Declaration] = {name: figure_module(name).DECLARATION for name in _NAMES}


def draw_figure(
    name: str,
    png: str | os.PathLike,
    pdf: str | os.PathLike,
    *,
    inputs: Mapping[str, str | Sequence[str]],
    arguments: Mapping[str, Any],
) -> None:
    """Draw a figure and write it to `png` and `pdf`; if no run in the figure is complete, write a message only.

    The `inputs` are paths of files. The `arguments` are keyword arguments of the function `figure`.
    """
    from icha.figures.select import NothingToDraw

    data = {argument: _read(files) for argument, files in inputs.items()}
    try:
        figure = figure_module(name).figure(**data, **arguments)
    except NothingToDraw as reason:
        print(f"Nothing to draw, so the page contains only a message: {reason}")
        figure = _empty_page(str(reason))
    save(figure, png, pdf)


def _read(files):
    """Return the content of netCDF files as datasets or trees; return the paths of other files unchanged."""
    from icha.datasets.files import has_groups, read_campaign, read_dataset

    if not isinstance(files, str | os.PathLike):
        return [_read(file) for file in files]
    if not str(files).endswith(".nc"):
        return files
    return read_campaign(files) if has_groups(files) else read_dataset(files)


@in_style
def _empty_page(reason) -> Figure:
    figure = new_figure(5.0, 2.5)
    figure.text(0.5, 0.5, textwrap.fill(reason, 60), ha="center", va="center", color=GREY, parse_math=False)
    return figure
