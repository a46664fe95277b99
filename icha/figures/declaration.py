"""Declaration of a figure: the options of the figure in a configuration, and the input files.

Every figure is a module `fig<number>_<words>` of this folder, with a `DECLARATION` and a function `figure` that draws.
`icha.figures.registry` finds these modules by their names, so no list of figures exists. To read a configuration, ICHA
imports the modules of all figures. The libraries matplotlib and xarray load slowly. Therefore the modules import these
libraries only inside functions that draw.

The function `figure` has two kinds of arguments: data from the files in `inputs`, and the `arguments` of the options.
The function raises `icha.figures.select.NothingToDraw` if no run in the figure is complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import Field

from icha.contact.models import REFERENCE_MODEL, first_model
from icha.datasets import results
from icha.datasets.labels import RunLabels
from icha.path.snapshots import Snapshot
from icha.support.values import Label, Name, Positive, Problem, Section, Seed, list_names, unknown

# Stands for the class `icha.configuration.campaign.Campaign`, which modules of this folder must not import.
Campaign = Any
_NOT_UNLOADED = "is not unloaded; expected a study with `unload: true`"
# Input files by argument of the function `figure`: one path or a list of paths for each argument.
Inputs = dict[str, str | list[str]]


class FigureOptions(Section):
    """Options of a figure: one section of the configuration."""

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Yield a problem for each option that does not fit the campaign, such as the name of an unknown study."""
        yield from ()

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """Return the studies whose runs the figure shows."""
        return ()

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the keyword arguments of the function `figure`, except the data."""
        return self.model_dump(exclude_none=True)


def dataset_only(campaign: Campaign, options: FigureOptions, files: results.ResultFiles) -> Inputs:
    """Return the path of the campaign dataset, the only input of many figures."""
    return {"campaign": files.path(results.DATASET)}


def dataset_and_theories(campaign: Campaign, options: StudyFigure, files: results.ResultFiles) -> Inputs:
    """Return the paths of the campaign dataset, and of the theories for the study's first surface, if it is flat."""
    surface = campaign.studies[options.study].surfaces[0]
    theories = {"references": files.path(results.THEORIES, surface=surface)} if campaign.is_flat(surface) else {}
    return {"campaign": files.path(results.DATASET)} | theories


def dataset_and_model_error(campaign: Campaign, options: ComparedFigure, files: results.ResultFiles) -> Inputs:
    """Return the paths of the model error and of the campaign dataset. The campaign dataset determines the colours."""
    return {"campaign": files.path(results.DATASET), "model_error": files.path(results.MODEL_ERROR)}


@dataclass(frozen=True)
class Declaration:
    """Description, options and input files of a figure.

    Parameters
    ----------
    description : what the figure shows, in one line, for authors of configurations.
    options : class of the options. The first line of the docstring of the class is the description in the schema.
    inputs : function that returns paths of input files. `figure` receives netCDF files as datasets, others as paths.
    holds_topography : True if drawing needs memory for all heights of the surface.
    """

    description: str
    options: type[FigureOptions]
    inputs: Callable[[Campaign, Any, results.ResultFiles], Inputs] = dataset_only
    holds_topography: bool = False


# --- options that several figures have ---


class StudyFigure(FigureOptions):
    """A figure of all runs of a study."""

    study: Name = Field(description="Name of the study that is drawn.")

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """Return the name of the only study that the figure shows."""
        return (self.study,)

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Yield a problem if the study does not exist; otherwise yield the problems from `study_problems`."""
        yield from unknown(("study",), self.study, campaign.studies)
        if self.study in campaign.studies:
            yield from self.study_problems(campaign, campaign.studies[self.study])

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """Yield a problem for each requested surface, seed, material or slope that the study does not have."""
        for key, present in (
            ("surface", study.surfaces),
            ("seed", study.seeds),
            ("material", study.materials),
            ("rms_slope", study.rms_slopes),
        ):
            value = getattr(self, key, None)
            if value is not None and value not in present:
                yield (key,), value, f"is not in study {self.study!r}; expected one of {list_names(present)}"


class TruthFigure(StudyFigure):
    """A figure of all runs of a study, with boundary elements."""

    boundary_elements: Name | None = Field(
        default=None,
        description="Name of a study whose runs with boundary elements are also drawn. Default: the study itself, if "
        "it has such runs.",
    )

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """Return the name of the study and, if different, the name of the study with boundary elements."""
        return tuple(dict.fromkeys(filter(None, (self.study, self.boundary_elements))))

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """Also yield a problem if the study in `boundary_elements` does not exist or has no boundary elements."""
        yield from super().problems(campaign)
        if self.boundary_elements is None:
            return
        location, name = ("boundary_elements",), self.boundary_elements
        yield from unknown(location, name, campaign.studies)
        if name in campaign.studies and REFERENCE_MODEL not in campaign.studies[name].models:
            expected = f"expected a study with {REFERENCE_MODEL!r} among its `models`"
            yield location, name, f"has no runs with boundary elements; {expected}"


class SnapshotFigure(StudyFigure):
    """A figure of one snapshot of a study."""

    snapshot: Snapshot | None = Field(default=None, description="Snapshot of the study. Default: the first one.")

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """Also yield a problem if the study does not have the snapshot."""
        yield from super().study_problems(campaign, study)
        snapshots = campaign.studies[self.study].saved_states
        if snapshots == []:
            yield ("study",), self.study, "has no snapshot to draw; expected a study with `snapshots`"
        elif self.snapshot is not None and self.snapshot.kind_and_value not in (snapshots or []):
            kept = list_names(f"{kind} {value:g}" for kind, value in snapshots or []) or "none"
            kind, value = self.snapshot.kind_and_value
            problem = f"is not a snapshot of study {self.study!r}; expected one of: {kept}"
            yield ("snapshot",), f"{kind} {value:g}", problem

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the arguments of `figure`, with the `kind` and the `target` of the snapshot."""
        arguments = super().arguments(campaign)
        if arguments.pop("snapshot", None) is not None:
            arguments["kind"], arguments["target"] = self.snapshot.kind_and_value
        return arguments


class UnitsFigure(FigureOptions):
    """A figure in reduced or in physical units."""

    units: Literal["reduced", "physical"] = Field(
        default="reduced",
        description="`reduced`: loads in units of E* h'rms, separations in units of the rms height. `physical`: "
        "nominal pressures in Pa, and mean gaps (figure 13: mean separations) in m, with prefixes.",
    )

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the arguments of `figure`; the default units are left out."""
        arguments = super().arguments(campaign)
        return {name: value for name, value in arguments.items() if (name, value) != ("units", "reduced")}


class TopographyFigure(StudyFigure):
    """A figure of one topography of a study."""

    surface: Label | None = Field(default=None, description="Surface to show. Default: the first surface of the study.")
    seed: Seed | None = Field(default=None, description="Seed to show. Default: the first seed of the study.")


class UnloadedFigure(StudyFigure):
    """A figure of the runs of a study in loading and unloading."""

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """Also yield a problem if the study does not unload."""
        yield from super().study_problems(campaign, study)
        if not (study.unload or study.turning_points):
            yield ("study",), self.study, _NOT_UNLOADED


class RunFigure(TopographyFigure):
    """A figure of one run. ICHA draws the first run that fits the options, if possible a run with adhesion."""

    rms_slope: Positive | None = Field(default=None, description="Rms slope to show. Default: the study's first slope.")
    material: Label | None = Field(
        default=None, description="Material to show. Default: the first material with adhesion, if any."
    )

    def arguments(self, campaign: Campaign) -> dict[str, Any]:
        """Return the arguments of `figure`, with the labels of the run."""
        arguments = super().arguments(campaign)
        others = arguments.keys() - set(RunLabels._fields)
        return {name: arguments[name] for name in others} | {"run": tuple(self.run(campaign))}

    def run(self, campaign: Campaign) -> RunLabels:
        """Return the first run that fits the options; a run with adhesion is preferred."""
        model = first_model(campaign.studies[self.study].models)
        wanted = self.model_dump(include=set(RunLabels._fields), exclude_none=True)
        runs = [contact._replace(model=model) for contact in campaign.contacts(self.study)]
        runs = [run for run in runs if wanted.items() <= run._asdict().items()]
        return next((run for run in runs if campaign.materials[run.material].surface_energy > 0), runs[0])


class ComparedFigure(StudyFigure):
    """A comparison with boundary elements. The study needs both models."""

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """Also yield a problem if the study has no boundary elements at the loads of its asperity runs."""
        yield from super().study_problems(campaign, study)
        if not campaign.compares_models(self.study):
            expected = "expected a study with both `models` and targets `reduced_pressures`"
            yield ("study",), self.study, f"has no boundary elements at the same loads; {expected}"


def problems_of_unloading(campaign: Campaign, studies: Mapping[tuple, str]) -> Iterator[Problem]:
    """Yield a problem for each study that does not exist or does not unload; `studies` maps keys to names."""
    for location, name in studies.items():
        yield from unknown(location, name, campaign.studies)
        if name in campaign.studies and not campaign.studies[name].unload:
            yield location, name, _NOT_UNLOADED
