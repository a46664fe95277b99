"""A contact whose equilibria are kept as they are found: a path that takes hours can be gone on with.

What is kept is what the contact was asked for, in turn, and is named by all that had been asked up to there. So the
same path, begun again, finds it there as far as it had come, and has the same states to the last bit; another one finds
what it has in common with it.
"""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic

import numpy as np

from icha.contact.model import ContactModel, Control, FullContact, NotConverged, S
from icha.support.atomic_files import whole_file

_FAILURES = {kind.__name__: kind for kind in (NotConverged, FullContact)}
# What the kept equilibria are of.
_OF = "of.txt"


@dataclass(frozen=True, eq=False)
class Kept(Generic[S]):
    """A `ContactModel` that looks for an equilibrium only if its folder does not have it yet.

    contact : the model. of : what tells it apart from all others of its kind. folder : of equilibria, one file each.
    packed : arrays, by name, that a state that followed from another one is made of. unpacked : that state from these.
    """

    contact: ContactModel[S]
    of: str
    folder: Path
    packed: Callable[[S, S], dict[str, np.ndarray]]
    unpacked: Callable[[dict[str, np.ndarray], S], S]
    _asked: Any = field(default_factory=hashlib.sha256)

    def equilibrium(self, state: S, separation: float, control: Control | None = None, *, let_go: int = 0) -> S:
        """As of the contact."""
        held = control and (control.quantity, float(control.target))
        self._asked.update(repr((float(separation), held, let_go)).encode())
        file = self.folder / f"{self.of}-{self._asked.hexdigest()[:32]}.npz"
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
        """All else is the contact's."""
        return getattr(self.contact, name)


def prepared(folder: Path, of: str) -> Path:
    """The folder, with nothing in it that was kept of something else.

    of : what tells the surface, the material, the path and the code apart from all others.

    Raises
    ------
    OSError
        If what was kept of something else cannot be removed, or nothing can be written there.
    """
    written = folder / _OF
    if not written.exists() or written.read_text(encoding="utf-8", errors="replace") != of:
        if folder.exists():
            shutil.rmtree(folder)
        with whole_file(written) as file:
            file.write_text(of, encoding="utf-8")
    return folder


def _read(file):
    """The arrays of a file; None without one, or of one that is damaged, whose equilibrium is looked for again."""
    try:
        with np.load(file) as arrays:
            return dict(arrays)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None


def _write(file, arrays):
    with whole_file(file) as part, part.open("wb") as stream:
        np.savez(stream, **arrays)
