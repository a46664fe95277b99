"""Sections `finite_range` and `boundary_element_loops`: boundary elements beside the runs of a study."""

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from icha.asperity.cohesive_zone import resolution_problem
from icha.asperity.material import Material
from icha.configuration.studies import MEASURED
from icha.contact.models import DEFAULT_MODEL
from icha.path.states import ReducedPressure
from icha.path.targets import STEP
from icha.support.rules import GRID, REFINEMENT, TOLERANCE
from icha.support.values import (
    Label,
    Name,
    Positive,
    Problem,
    Section,
    Seeds,
    distinct,
    increasing,
    integer,
    list_names,
    list_of_names,
    number,
    stops,
    unknown,
)

_Labels = list_of_names(Label)


class BesideStudy(Section):
    """Boundary elements on the topographies of a study."""

    study: Name
    """Name of the study with the topographies."""
    surfaces: _Labels | None = None
    """Surfaces of the study. Default: all."""
    seeds: Seeds | None = None
    """Seeds of the study. Default: all."""
    rms_slopes: Annotated[list[Positive], Field(min_length=1), AfterValidator(distinct)] | None = None
    """Rms slopes of the study. Default: all."""
    materials: _Labels | None = None
    """Materials of the study. Default: all. With adhesion, the grid must resolve their `interaction_range`."""
    tolerance: number(TOLERANCE) = 1e-8
    """Relative error at which the solver has converged."""
    refinement: integer(REFINEMENT) = 1
    """Number of cells of the solver per cell of the surface's grid, along a side. The heights are interpolated."""

    def problems(self, campaign: Any) -> Iterator[Problem]:
        """Report entries that the `icha.configuration.campaign.Campaign` does not have, or that cannot be solved."""
        yield from unknown(("study",), self.study, campaign.studies)
        if self.study in campaign.studies:
            yield from self._study_problems(campaign, campaign.studies[self.study])

    def _study_problems(self, campaign, study):
        if DEFAULT_MODEL not in study.models:
            reason = f"has no runs to compare with; expected a study with {DEFAULT_MODEL!r} among its `models`"
            yield ("study",), self.study, reason
        for key in ("surfaces", "seeds", "rms_slopes", "materials"):
            known = set(getattr(study, key))
            for index, value in enumerate(getattr(self, key) or []):
                if value not in known:
                    expected = list_names(getattr(study, key))
                    yield (key, index), value, f"is not in study {self.study!r}; expected one of {expected}"
        contacts = campaign.contacts_beside(self)
        if not contacts and MEASURED not in study.rms_slopes:
            yield (
                (),
                self.study,
                "has no run with the chosen surfaces, seeds, slopes and materials; expected combinations of the study",
            )
        pairs = list(dict.fromkeys((each.surface, each.material) for each in contacts))
        for name in dict.fromkeys(name for name, _ in pairs):
            if campaign.is_free(name):
                reason = f"has the surface {name!r} with free edges; expected a study of periodic surfaces"
                yield ("study",), self.study, reason
            elif campaign.grid(name) is not None:
                nodes = campaign.grid(name) * self.refinement
                if nodes > GRID.most:
                    reason = f"gives {nodes} nodes a side on {name!r}; expected at most {GRID.most}"
                    yield ("refinement",), self.refinement, reason
                for label in (material for surface, material in pairs if surface == name):
                    material = Material(**campaign.materials[label].model_dump(exclude_none=True))
                    if problem := resolution_problem(material, campaign.period(name) / nodes):
                        yield ("materials",), label, f"on surface {name!r}: {problem}"


class BoundaryElements(BesideStudy):
    """Boundary elements at a finite range of attraction on the topographies of a study, to compare with its runs."""

    reduced_pressures: stops(ReducedPressure, increasing)
    """Loads p/(E* h'rms), increasing. The runs of the study save a snapshot at each of these loads."""


class BoundaryElementLoops(BesideStudy):
    """Boundary elements at a finite range of attraction, loaded to the largest load of a study and unloaded."""

    separation_step: number(STEP) = 0.05
    """Change of the mean gap from one solution to the next, in units of h_rms."""

    def _study_problems(self, campaign, study):
        """Report also a study that does not unload, or not from a reduced pressure."""
        if not study.unload or study.turning_points:
            reason = "does not unload after its targets; expected a study with `unload: true` and no turning points"
            yield ("study",), self.study, reason
        if study.targets.last[0] != "reduced_pressure":
            reason = "has other targets; expected reduced pressures, because unloading begins at the last one"
            yield ("study",), self.study, reason
        yield from super()._study_problems(campaign, study)
