"""Imports of the fork server, before its first fork: the whole package, as far as jobs may need it."""

import contextlib
import os
from importlib import import_module
from pathlib import Path

import icha
from icha.support.program import end_with_parent

SERVER = os.getpid()
# The command line, and what only a deposit needs.
_BESIDES = ("cli", "publication")
# What libraries import when it is first used.
_LATE = ("pint", "PIL.PngImagePlugin", "matplotlib.style", "matplotlib.backends.backend_pdf", "fontTools.subset")


def _modules():
    top = Path(icha.__file__).parent
    files = [file.relative_to(top) for file in sorted(top.rglob("*.py")) if file.stem != "__init__"]
    return [".".join(("icha", *file.with_suffix("").parts)) for file in files if file.parts[0] not in _BESIDES]


end_with_parent(os.getppid())
for _name in [*_modules(), *_LATE]:
    # What is missing here, a job will say.
    with contextlib.suppress(Exception):
        import_module(_name)
