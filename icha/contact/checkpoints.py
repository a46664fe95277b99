"""Checkpoints: save each equilibrium of a contact, so that an interrupted run can resume.

The name of a checkpoint depends on all earlier solves and on their order. If a path is repeated after an interruption,
it loads exactly the same equilibria up to the interruption. A different path loads the equilibria only up to the first
difference between both paths.
"""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from icha.contact.model import Control, FullContact, NotConverged
from icha.support.atomic_files import whole_file

_FAILURES = {kind.__name__: kind for kind in (NotConverged, FullContact)}
# File with the text that identifies the contact of all checkpoints in a folder.
_OF = "of.txt"


@dataclass(frozen=True, eq=False)
class CheckpointedContact:
    """Contact model that loads an equilibrium from a checkpoint, or finds the equilibrium and saves a checkpoint.

    Attributes
    ----------
    contact : `icha.contact.model.ContactModel`.
    of : text that identifies the contact.
    folder : folder of the checkpoints, one file each.
    packed : function that converts a new state to named arrays; its second argument is the previous state.
    unpacked : function that converts these arrays to the state; its second argument is the previous state.
    """

    contact: Any
    of: str
    folder: Path
    packed: Callable[[Any, Any], dict[str, np.ndarray]]
    unpacked: Callable[[dict[str, np.ndarray], Any], Any]
    _solves: Any = field(default_factory=hashlib.sha256)

    def equilibrium(self, state: Any, separation: float, control: Control | None = None, *, let_go: int = 0) -> Any:
        """Load an equilibrium from a checkpoint, or find and save the equilibrium; see `ContactModel.equilibrium`."""
        target = control and (control.quantity, float(control.target))
        self._solves.update(repr((float(separation), target, let_go)).encode())
        file = self.folder / f"{self.of}-{self._solves.hexdigest()[:32]}.npz"
        found = _read(file)
        if found is not None:
            if "failure" in found:
                raise _FAILURES[str(found["failure"])](str(found["message"]))
            return self.unpacked(found, state)
        try:
            new = self.contact.equilibrium(state, separation, control, let_go=let_go)
        except NotConverged as failure:
            _write(file, {"failure": type(failure).__name__, "message": str(failure)})
            raise
        _write(file, self.packed(new, state))
        return new

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the contact that this class does not define."""
        return getattr(self.contact, name)


def prepare_checkpoints(folder: Path, of: str) -> Path:
    """Return the folder of checkpoints of a contact; first remove checkpoints of another contact in this folder.

    of : text that identifies surface, material, path and code. Raise `OSError` if the folder is not writable.
    """
    written = folder / _OF
    if not written.exists() or written.read_text(encoding="utf-8", errors="replace") != of:
        if folder.exists():
            shutil.rmtree(folder)
        with whole_file(written) as file:
            file.write_text(of, encoding="utf-8")
    return folder


def _read(file):
    """Return the arrays of a checkpoint by name; None if the file does not exist or is damaged."""
    try:
        with np.load(file) as arrays:
            return dict(arrays)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None


def _write(file, arrays):
    """Write arrays, by name, to a checkpoint; an interrupted write leaves no file."""
    with whole_file(file) as part, part.open("wb") as stream:
        np.savez(stream, **arrays)
