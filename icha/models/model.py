"""What a run needs to know of a model of contact."""

import pathlib
from collections.abc import Callable
from dataclasses import dataclass

from icha.asperity.material import Material
from icha.contact.model import ContactModel
from icha.contact.observables import Observables
from icha.path.targets import Path
from icha.surfaces.surface import Surface


@dataclass(frozen=True)
class Model:
    """A model of contact.

    Parameters
    ----------
    title, method : what it is, for the title and the summary of a run.
    references : publications of its methods.
    observables : of the contact of a surface and a material, for a path; ValueError if it cannot be computed.
    kept : its contact with equilibria kept in a folder; None if it has none that take long.
    """

    title: str
    method: str
    references: str
    observables: Callable[[Surface, Material, Path], Observables]
    kept: Callable[[ContactModel, pathlib.Path], ContactModel] | None = None
