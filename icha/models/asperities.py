"""Interacting and coalescing asperities: the model of Violano & Afferrante."""

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.datasets.attributes import MODEL_PAPER
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.equilibrium.observables import AsperityObservables
from icha.models.model import Model
from icha.path.targets import Path
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface


def _observables(surface: Surface, material: Material, path: Path) -> AsperityObservables:
    contact = InteractingAsperities(JKR(material), find_summits(surface), surface.rms_height)
    return AsperityObservables(contact, surface)


MODEL = Model(
    title="ICHA model",
    method="interacting and coalescing asperities with JKR adhesion and jump into contact",
    references=(
        f"{MODEL_PAPER.line}; "
        "L. Afferrante, G. Carbone and G. Demelio, Wear 278-279 (2012) 28-33, doi:10.1016/j.wear.2011.12.013; "
        "J.-J. Wu, J. Phys. D: Appl. Phys. 43 (2010) 415303"
    ),
    observables=_observables,
)
