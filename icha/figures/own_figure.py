"""A figure that a Python file of the user draws: its function `draw` receives a study and returns a figure."""

import contextlib
import runpy
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from icha.figures.drawn import record
from icha.figures.style import in_style


@contextlib.contextmanager
def _importing_from(folder: Path) -> Iterator[None]:
    """Context manager: find modules in a folder, as for a script there; leave no bytecode, and forget the modules."""
    before, bytecode = set(sys.modules), sys.dont_write_bytecode
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        sys.dont_write_bytecode = bytecode
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None)
            if file and Path(file).is_relative_to(folder):
                del sys.modules[name]


@in_style
def own(campaign: xr.DataTree, script: str, *, study: str) -> Figure:
    """Draw a study with the function `draw` of a script, in the style of all figures."""
    try:
        with _importing_from(Path(script).resolve().parent):
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
