"""From the files of a figure's inputs to its own."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from icha.datasets.files import has_groups, read_campaign, read_dataset
from icha.figures.registry import figure_module
from icha.figures.select import NothingToDraw
from icha.figures.style import GREY, new_figure, save, styled


def draw_figure(
    name: str,
    png: str | os.PathLike,
    pdf: str | os.PathLike,
    *,
    inputs: Mapping[str, str | Sequence[str]],
    arguments: Mapping[str, Any],
) -> None:
    """Draw a figure and write it to `png` and `pdf`.

    `inputs` and `arguments` are those of its declaration. Where nothing of what it shows is complete, the figure is an
    empty page that says so.
    """
    data = {argument: _read(files) for argument, files in inputs.items()}
    try:
        figure = figure_module(name).figure(**data, **arguments)
    except NothingToDraw as reason:
        # The verdict says which runs failed; what can be drawn is drawn.
        print(f"An empty page: {reason}")
        figure = _empty_page(str(reason))
    save(figure, png, pdf)


def _read(files):
    """A dataset or tree of a netCDF file, a list of those of several files; of other files the path."""
    if not isinstance(files, str | os.PathLike):
        return [_read(file) for file in files]
    if not str(files).endswith(".nc"):
        return files
    return read_campaign(files) if has_groups(files) else read_dataset(files)


@styled
def _empty_page(reason) -> Figure:
    figure = new_figure(5.0, 2.5)
    figure.text(0.5, 0.5, textwrap.fill(reason, 60), ha="center", va="center", color=GREY, parse_math=False)
    return figure
