"""Read the script of an own figure, without running it: its caption, and the modules that it imports."""

from __future__ import annotations

import ast
import os
from pathlib import Path

from icha.support.input_files import problem_with_path


def caption_in(script: str | os.PathLike) -> str:
    """Return the docstring of the function `draw` in a script, without running the script.

    Raise ValueError if the file cannot be read, is not Python, or has no such function.
    """
    tree = _parse(Path(script))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == "draw":
            return " ".join((ast.get_docstring(node) or "").split())
    raise ValueError("has no function `draw`; expected `def draw(study):`, which returns a figure of matplotlib")


def modules_of(script: str | os.PathLike) -> list[Path]:
    """Return the files of the modules that a script imports from its own folder, sorted; nothing is run.

    The modules that these modules import count too. Of a package, all Python files count. Raise ValueError if one of
    these files cannot be read, or is not Python.
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
