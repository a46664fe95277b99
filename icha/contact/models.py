"""Records of the contact models, without their solvers.

This module imports no solver, so that the fingerprints of figures, plans and configurations do not depend on solvers.
The cost of a model is in `icha.planning.costs`, and its colours and markers are in `icha.figures.looks`, because a
change of costs or colours must not recompute runs.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

# Largest error of an equilibrium of asperities, in h_rms.
RESIDUAL_TOLERANCE = 1e-9
# With adhesion a load is the difference of repulsion and attraction. The error of a load is divided by the load or, if
# larger, by this fraction of the repulsion.
SMALLEST_LOAD = 1e-4
# Largest error of a prescribed area, without adhesion, if contact is counted in whole cells. The smaller of both values
# applies: the first is in cells, the second is a fraction of the prescribed area.
AREA_TOLERANCE_CELLS, AREA_TOLERANCE_PART = 2.0, 0.1


class Paper(NamedTuple):
    """Paper on arXiv; each author is a pair of given and family names."""

    authors: tuple[tuple[str, str], ...]
    title: str
    year: int
    arxiv: str

    @property
    def address(self) -> str:
        """Address of the paper."""
        return f"https://arxiv.org/abs/{self.arxiv}"

    @property
    def line(self) -> str:
        """Citation of the paper in a text."""
        authors = " and ".join(f"{given[0]}. {family}" for given, family in self.authors)
        return f"{authors}, {self.title}, arXiv:{self.arxiv} ({self.year})"


# Paper of the asperity model. Volume and pages of the printed version could not be verified and are left out.
MODEL_PAPER = Paper(
    (("Guido", "Violano"), ("Luciano", "Afferrante")),
    "Modeling the adhesive contact of rough soft media with an advanced asperity model",
    2019,
    "1907.05859",
)


@dataclass(frozen=True)
class PathAccuracy:
    """Accuracy with which a path locates events, and computes work and largest tension between two equilibria.

    Attributes
    ----------
    target : largest relative error of a load or area that the solver meets.
    event : an event counts as located if the step that contains it is not longer than this value, in h_rms.
    work : largest error of the work of one step, relative to work and losses so far (see `icha.path.step_accuracy`).
    reversible_work : the same without adhesion, where most errors of loading and unloading cancel.
    tension : largest relative error of the largest tension in a step without events.
    """

    target: float = 1e-9
    event: float = 1e-12
    work: float = 3e-7
    reversible_work: float = 3e-6
    tension: float = 1e-8


@dataclass(frozen=True)
class Model:
    """Record of a contact model.

    Attributes
    ----------
    words : name of the model in sentences and legends, in the plural.
    title : name of the model at the end of the title of a run.
    method : name of the method at the end of the summary of a run.
    references : publications on the method, separated by "; ".
    module : module whose `contact_of(surface, material)` returns an `icha.contact.model.ContactModel`.
    folder : folder for the runs of this model, with a slash at the end; empty for the default model.
    variables : names of variables that only runs of this model have, with dimensions, unit, long name and type.
    stiffness_error : largest relative error of the contact stiffness, apart from the error by the grid.
    by_summits : whether summits represent the surface. If so, spots unite by a rule, which may lose or gain energy.
    by_cells : whether contact is counted in cells of the grid; runs then contain a map of the contact.
    accuracy : accuracy with which a path resolves its events.
    resumable : whether a run saves checkpoints; if so, `module` contains a function `resumable(contact, folder)`.
    """

    words: str
    title: str
    method: str
    references: str
    module: str
    folder: str = ""
    variables: Mapping[str, tuple[tuple[str, ...], str, str, str]] = field(default_factory=dict)
    stiffness_error: float = 1e-6
    by_summits: bool = False
    by_cells: bool = False
    accuracy: PathAccuracy = PathAccuracy()
    resumable: bool = False


_WU = "J.-J. Wu, J. Phys. D: Appl. Phys. 43 (2010) 415303"
_MAP = ("snapshot", "row", "column")
# The first model applies to runs without a model name. The second model is the reference in comparisons of models.
DEFAULT_MODEL, REFERENCE_MODEL = "asperities", "boundary_elements"
# Models by their names in configurations, in files and in `icha.simulate`.
MODELS = {
    DEFAULT_MODEL: Model(
        words="asperities",
        title="ICHA model",
        method="interacting and coalescing asperities with JKR adhesion and jump into contact",
        references=f"{MODEL_PAPER.line}; "
        f"L. Afferrante, G. Carbone and G. Demelio, Wear 278-279 (2012) 28-33, doi:10.1016/j.wear.2011.12.013; {_WU}",
        module="icha.equilibrium.interacting_asperities",
        by_summits=True,
    ),
    REFERENCE_MODEL: Model(
        words="boundary elements",
        title="boundary elements",
        method="boundary elements, at the range of attraction if the grid resolves it, otherwise in the limit of a "
        "short range with fronts at Griffith's energy release rate",
        references="A. A. Griffith, Phil. Trans. R. Soc. A 221 (1921) 163-198, doi:10.1098/rsta.1921.0006; "
        "K. L. Johnson, K. Kendall and A. D. Roberts, Proc. R. Soc. A 324 (1971) 301-313, doi:10.1098/rspa.1971.0141; "
        f"{_WU}",
        module="icha.boundary_elements.contact",
        folder="boundary_elements/",
        variables={
            "front_residual": (
                ("step",),
                "1",
                "largest residual pressure, over the peak tension of a cell at the edge or, without adhesion, over the "
                "largest pressure",
                "float64",
            ),
            "gap_residual": (
                ("step",),
                "1",
                "largest displacement by the residual pressures, over h_rms",
                "float64",
            ),
            "energetic_area_fraction": (
                ("step",),
                "1",
                "energy of adhesion divided by that of full contact; at a finite range of attraction, the integral of "
                "(1 - gap/range)^2 over the nominal area; without adhesion, the area of whole cells in contact",
                "float64",
            ),
            "layer_compression": (
                ("step",),
                "m",
                "mean displacement of the surface of a periodic layer by the nominal pressure, not part of "
                "mean_separation; 0 for a half-space and for a free square",
                "float64",
            ),
            "resolved_tension": (
                (),
                "Pa",
                "tension at which a cell at a straight edge of contact opens; 0 without adhesion. At a finite range of "
                "attraction, the strength of the interface; otherwise the largest tension that the grid resolves",
                "float64",
            ),
            "contact_map": (
                _MAP,
                "1",
                "part of the cell in contact; at a short range, contact_area_fraction is smaller than the mean: it "
                "is corrected for the edges",
                "float32",
            ),
            "contact_pressure": (_MAP, "Pa", "pressure in the cell, negative in tension", "float32"),
            "gap_map": (
                _MAP,
                "m",
                "gap at the node; where part of the cell is in contact, extension of the bond",
                "float32",
            ),
            "displacement_map": (
                _MAP,
                "m",
                "displacement of the surface of the elastic body at the node by the pressure, positive away from the "
                "rough surface; on a periodic surface, without its mean",
                "float32",
            ),
        },
        stiffness_error=1e-4,
        by_cells=True,
        # Fronts that hop from cell to cell lose energy that only a finer grid would resolve.
        accuracy=PathAccuracy(target=1e-6, event=1e-5, work=1e-4, tension=1e-5),
        resumable=True,
    ),
}


def model_of(attributes: Mapping[str, str]) -> Model:
    """Return the record of the model that computed a run with these global attributes."""
    return MODELS[attributes.get("contact_model", DEFAULT_MODEL)]


def first_model(models: Iterable[str]) -> str:
    """Return the model that comes first in `MODELS`, for a figure or text that shows only one of `models`."""
    return min(models, key=list(MODELS).index)
