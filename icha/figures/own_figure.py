"""A figure that a Python file of the user draws: its function `draw` receives a study and returns a figure."""

import runpy
import sys
import traceback
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from icha.figures.drawn import record
from icha.figures.style import in_style


@in_style
def own(campaign: xr.DataTree, script: str, *, study: str) -> Figure:
    """Draw a study with the function `draw` of a script, in the style of all figures.

    The script may import modules in its folder. They leave no bytecode there.
    """
    # The process ends after this figure, so it keeps the path and the modules.
    sys.path.insert(0, str(Path(script).resolve().parent))
    sys.dont_write_bytecode = True
    try:
        drawn = runpy.run_path(script)["draw"](campaign[study].to_dataset())
    except Exception as error:
        traceback.print_exc()
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == script]
        raise ValueError(f"{script}, line {lines[-1] if lines else 1}: {type(error).__name__}: {error}") from None
    if not isinstance(drawn, Figure):
        raise ValueError(f"{script}: draw returned {type(drawn).__name__}; expected a figure of matplotlib")
    for axes in drawn.axes:
        for line in axes.get_lines():
            record(axes, *line.get_data(), line.get_label())
    return drawn
