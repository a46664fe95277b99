"""Modules that the fork server imports before its first fork: all modules that jobs may need."""

import contextlib
import os
from importlib import import_module
from pathlib import Path

import icha
from icha.support.program import end_with_parent

SERVER = os.getpid()
# Subpackages that are not imported: the command line, and modules that only a deposit needs.
_EXCLUDED = ("cli", "deposit")
# Libraries import these modules only when a function needs them.
_LATE = ("pint", "PIL.PngImagePlugin", "matplotlib.style", "matplotlib.backends.backend_pdf", "fontTools.subset")


def _modules():
    top = Path(icha.__file__).parent
    files = [file.relative_to(top) for file in sorted(top.rglob("*.py")) if file.stem != "__init__"]
    return [".".join(("icha", *file.with_suffix("").parts)) for file in files if file.parts[0] not in _EXCLUDED]


# Snakemake may have been killed already, and then `os.getppid()` is the number of another process.
end_with_parent(int(os.environ["ICHA_EXECUTOR"]))
for _name in [*_modules(), *_LATE]:
    # If a module is missing, the job that needs this module reports the error.
    with contextlib.suppress(Exception):
        import_module(_name)
