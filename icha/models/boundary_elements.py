"""Boundary elements in the limit of a short range of attraction: fronts of contact obey Griffith's criterion."""

import hashlib
import pathlib
from importlib.metadata import version

from icha.asperity.material import Material
from icha.boundary_elements.contact import BoundaryElements
from icha.boundary_elements.observables import PatchObservables
from icha.boundary_elements.states import packed, unpacked
from icha.contact.kept import Kept
from icha.contact.observables import Observables
from icha.models.model import Model
from icha.path.targets import Path
from icha.surfaces.surface import Surface


def _observables(surface: Surface, material: Material, path: Path) -> Observables:
    return PatchObservables(BoundaryElements.of(surface, material), surface)


def _kept(contact: BoundaryElements, folder: pathlib.Path) -> Kept:
    programs = [(name, version(name)) for name in ("icha", "numpy", "scipy")]
    others = repr((contact.spacing, contact.law.material, programs)).encode()
    of = hashlib.sha256(contact.heights.tobytes() + others).hexdigest()
    return Kept(contact, of[:32], folder, packed, unpacked)


MODEL = Model(
    title="boundary elements",
    method="boundary elements in the limit of a short range of attraction, fronts at Griffith's energy release rate",
    references=(
        "A. A. Griffith, Phil. Trans. R. Soc. A 221 (1921) 163-198, doi:10.1098/rsta.1921.0006; "
        "K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. A 324 (1971) 301-313, doi:10.1098/rspa.1971.0141; "
        "J.-J. Wu, J. Phys. D: Appl. Phys. 43 (2010) 415303"
    ),
    observables=_observables,
    kept=_kept,
)
