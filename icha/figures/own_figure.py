"""A figure that a Python file of the user draws: its function `draw` receives a study and returns a figure."""

from __future__ import annotations

import ast
import contextlib
import os
import runpy
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field

from icha.datasets import results
from icha.figures.declaration import Campaign, Declaration, Inputs, StudyFigure
from icha.figures.style import in_style
from icha.support.input_files import problem_with_path
from icha.support.values import File

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class OwnFigure(StudyFigure):
    """A figure of your own. The key is the name of its files."""

    script: File = Field(
        description="Python file with a function `draw(study)`. The function receives the dataset of the study "
        "(xarray.Dataset), and returns a figure of matplotlib. Its docstring is the caption. The file may import "
        "modules in its folder. The path is relative to the configuration file."
    )

    def arguments(self, campaign: Campaign) -> dict:
        """Return the name of the study; the script is an input."""
        return {"study": self.study}


def inputs(campaign: Campaign, options: OwnFigure, files: results.ResultFiles) -> Inputs:
    """Return the paths of the campaign dataset and of the script."""
    return {"campaign": files.path(results.DATASET), "script": options.script}


DECLARATION = Declaration(description="A figure that a Python file draws.", options=OwnFigure, inputs=inputs)


def caption_in(script: str | os.PathLike) -> str:
    """Return the docstring of the function `draw` in a script, without running the script.

    Raises
    ------
    ValueError
        If the file cannot be read, is not Python, or has no such function.
    """
    tree = _parse(Path(script))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == "draw":
            return " ".join((ast.get_docstring(node) or "").split())
    raise ValueError("has no function `draw`; expected `def draw(study):`, which returns a figure of matplotlib")


def modules_of(script: str | os.PathLike) -> list[Path]:
    """Return the files of the modules that a script imports from its own folder, sorted; nothing is run.

    The modules that these modules import count too. Of a package, all Python files count.

    Raises
    ------
    ValueError
        If one of these files cannot be read, or is not Python.
    """
    script = Path(script).resolve()
    found, pending = {script}, [script]
    while pending:
        nodes = [node for node in ast.walk(_parse(pending.pop())) if isinstance(node, ast.Import | ast.ImportFrom)]
        names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module and not node.level}
        for place in (script.parent / name.partition(".")[0] for name in sorted(names)):
            files = set(place.rglob("*.py")) if place.is_dir() else {place.with_suffix(".py")}
            new = {file for file in files if os.path.lexists(file)} - found
            found |= new
            pending += new
    return sorted(found - {script})


def _parse(file: Path) -> ast.Module:
    """Return the syntax tree of a Python file; raise ValueError if the file cannot be read, or is not Python."""
    if problem := problem_with_path(file):
        raise ValueError(f"{problem}; expected a Python file")
    try:
        return ast.parse(file.read_bytes(), file.name)
    except (SyntaxError, ValueError) as error:
        raise ValueError(f"is not a Python file: {error}; expected a file with a function draw(study)") from None


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
def figure(campaign: xr.DataTree, script: str, *, study: str) -> Figure:
    """Draw a study with the function `draw` of a script, in the style of all figures."""
    from matplotlib.figure import Figure

    try:
        with _importing_from(Path(script).resolve().parent):
            drawn = runpy.run_path(script)["draw"](campaign[study].to_dataset())
    except Exception as error:
        traceback.print_exc()
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == script]
        raise ValueError(f"{script}, line {lines[-1] if lines else 1}: {type(error).__name__}: {error}") from None
    if not isinstance(drawn, Figure):
        raise ValueError(f"{script}: draw returned {type(drawn).__name__}; expected a figure of matplotlib")
    return drawn
