"""The declaration of a figure: what a campaign may ask of it, and what it is drawn from.

A module `fig<number>_<words>` of this folder is a figure: it has a `DECLARATION` and a function `figure` that draws it.
Nothing else knows its name, for `icha.figures.registry` finds it. Reading a configuration imports all of them, so that
they import libraries for drawing, and modules that need xarray, only where they draw.

The function `figure` takes the data of its `inputs`, and as keywords the `arguments` of its options, which describe
them. It raises ValueError where the campaign has no such study, run or snapshot, naming what there is, and
`icha.figures.select.NothingToDraw` where no run of what it shows is complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from icha.contact.models import MODELS, REFERENCE_MODEL, first_model
from icha.datasets import results
from icha.datasets.labels import RunLabels
from icha.path.states import Snapshot
from icha.support.values import Label, Name, Positive, Problem, Section, Seed, listed, unknown

# A configuration (`icha.configuration.campaign.Campaign`), which stands above this folder.
Campaign = Any
# Files by the names of the arguments that are read from them: one, or a list of them.
Inputs = dict[str, str | list[str]]


class FigureOptions(Section):
    """The section of a figure in a configuration."""

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """What keeps the figure from being drawn although each of its values is allowed by itself."""
        yield from ()

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """The studies whose runs it shows."""
        return ()

    def arguments(self) -> dict[str, Any]:
        """Arguments of the function that draws it, other than data."""
        return self.model_dump(exclude_none=True)


def dataset_only(campaign: Campaign, options: FigureOptions, files: results.ResultFiles) -> Inputs:
    """The inputs of a figure of the campaign dataset alone."""
    return {"campaign": files.path(results.DATASET)}


@dataclass(frozen=True)
class Declaration:
    """What a figure is, but for its drawing.

    Parameters
    ----------
    description : what it shows, in a line, for those who write configurations.
    options : the model of its section; its first line of documentation is part of the schema.
    inputs : the files of its arguments. Results are read; of other files the paths are handed over.
    arguments : arguments that the rest of the configuration gives, beside those of the options.
    holds_topography : whether it takes memory for arrays of the surface's size.
    """

    description: str
    options: type[FigureOptions]
    inputs: Callable[[Campaign, Any, results.ResultFiles], Inputs] = dataset_only
    arguments: Callable[[Campaign, Any], dict[str, Any]] = lambda campaign, options: {}
    holds_topography: bool = False


# --- options that several figures have, with what keeps them from being drawn ---


class StudyFigure(FigureOptions):
    """A figure of all runs of a study."""

    study: Name = Field(description="Name of the study that is drawn.")

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """The one."""
        return (self.study,)

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """A study that is not there; and, if it is, what is wrong with it."""
        yield from unknown(("study",), self.study, campaign.studies)
        if self.study in campaign.studies:
            yield from self.study_problems(campaign, campaign.studies[self.study])

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """What is asked for that the study does not have."""
        for key, there in (
            ("surface", study.surfaces),
            ("seed", study.seeds),
            ("material", study.materials),
            ("rms_slope", study.rms_slopes),
        ):
            value = getattr(self, key, None)
            if value is not None and value not in there:
                yield (key,), value, f"is not in study {self.study!r}; allowed: {listed(there)}"


class TruthFigure(StudyFigure):
    """A figure of all runs of a study, with those by boundary elements."""

    boundary_elements: Name | None = Field(
        default=None,
        description="Name of a study whose runs by boundary elements are also drawn. Left out: the study itself, if it "
        "has such runs.",
    )

    def studies_of(self, campaign: Campaign) -> tuple[str, ...]:
        """The study, and the one beside it."""
        return tuple(dict.fromkeys(filter(None, (self.study, self.boundary_elements))))

    def problems(self, campaign: Campaign) -> Iterator[Problem]:
        """A study beside it that is not there, or has no runs by boundary elements."""
        yield from super().problems(campaign)
        beside = self.boundary_elements
        if beside is None:
            return
        yield from unknown(("boundary_elements",), beside, campaign.studies)
        if beside in campaign.studies and REFERENCE_MODEL not in campaign.studies[beside].models:
            reason = f"has no runs by boundary elements; allowed: a study with {REFERENCE_MODEL!r} among its `models`"
            yield ("boundary_elements",), beside, reason


class SnapshotFigure(StudyFigure):
    """A figure of one snapshot of a study."""

    snapshot: Snapshot | None = Field(
        default=None, description="Which of the study's snapshots. Left out: the first one."
    )

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """A snapshot that is not there is one more."""
        yield from super().study_problems(campaign, study)
        snapshots = campaign.snapshots_of(self.study)
        if snapshots == []:
            yield ("study",), self.study, "keeps no snapshot to draw; allowed: a study with one"
        if self.snapshot is not None and self.snapshot.target not in (snapshots or []):
            there = listed(f"{kind} {value:g}" for kind, value in snapshots or [])
            kind, value = self.snapshot.target
            reason = f"is no snapshot of study {self.study!r}; allowed: {there or 'none, for the study names none'}"
            yield ("snapshot",), f"{kind} {value:g}", reason

    def arguments(self) -> dict[str, Any]:
        """The snapshot by its kind and target."""
        arguments = super().arguments()
        if arguments.pop("snapshot", None) is not None:
            arguments["kind"], arguments["target"] = self.snapshot.target
        return arguments


class RunFigure(StudyFigure):
    """A figure of one run; what is left out is the study's first."""

    surface: Label | None = Field(default=None, description="Surface that is shown.")
    seed: Seed | None = Field(default=None, description="Seed that is shown.")
    rms_slope: Positive | None = Field(default=None, description="Rms slope that is shown.")
    material: Label | None = Field(
        default=None, description="Material that is shown. Left out: the first one with adhesion, if there is any."
    )

    def arguments(self) -> dict[str, Any]:
        """The surface by its name, for `surface` is its dataset."""
        arguments = super().arguments()
        if "surface" in arguments:
            arguments["surface_name"] = arguments.pop("surface")
        return arguments

    def run(self, campaign: Campaign) -> RunLabels:
        """The run that is shown: of the study's that are asked for the first with adhesion, or the first of all."""
        model = first_model(campaign.studies[self.study].models)
        runs = [
            run
            for run in (RunLabels(self.study, model, *contact) for contact in campaign.contacts(self.study))
            if self.surface in (None, run.surface)
            and self.seed in (None, run.seed)
            and self.rms_slope in (None, run.rms_slope)
            and self.material in (None, run.material)
        ]
        return next((run for run in runs if campaign.materials[run.material].surface_energy > 0), runs[0])


class ComparedFigure(StudyFigure):
    """A figure that compares a study's runs with boundary elements."""

    def study_problems(self, campaign: Campaign, study: Any) -> Iterator[Problem]:
        """A study without boundary elements is one more."""
        yield from super().study_problems(campaign, study)
        if not is_compared(campaign, self.study):
            if set(study.models) == set(MODELS):
                reason = (
                    f"has boundary elements, but its targets are {study.targets.last[0]}s, and errors are compared at "
                    "the same load; allowed: a study with both `models` and reduced_pressures for targets"
                )
            else:
                reason = (
                    "has no boundary elements beside it; allowed: a study with both `models` and reduced pressures "
                    "for targets, or one that an entry of finite_range names"
                )
            yield ("study",), self.study, reason


def is_compared(campaign: Campaign, study: str) -> bool:
    """Whether there are boundary elements beside the runs of a study, in either limit of the range."""
    return campaign.compares_models(study) or is_solved_at_finite_range(campaign, study)


def is_solved_at_finite_range(campaign: Campaign, study: str) -> bool:
    """Whether there are boundary elements at a finite range beside the runs of a study."""
    return any(entry.study == study for entry in campaign.finite_range.values())


def finite_range_error(campaign: Campaign, study: str, files: results.ResultFiles) -> Inputs:
    """The error against boundary elements at a finite range as an input, where there are any beside a study."""
    return {"model_error": files.path(results.MODEL_ERROR)} if is_solved_at_finite_range(campaign, study) else {}


def not_unloaded(campaign: Campaign, location: tuple, name: str, *, in_part: bool) -> Iterator[Problem]:
    """A study that does not come back, in figures of the way back; if `in_part` it need not come back all the way."""
    if name not in campaign.studies:
        return
    study = campaign.studies[name]
    if not (study.unload or (in_part and study.turning_points)):
        yield location, name, "is not unloaded; allowed: a study with `unload: true`"


def studies_problems(campaign: Campaign, key: str, names: Iterable[str]) -> Iterator[Problem]:
    """What is wrong with a list of studies that come back all the way."""
    for index, name in enumerate(names):
        yield from unknown((key, index), name, campaign.studies)
        yield from not_unloaded(campaign, (key, index), name, in_part=False)


def campaign_and_model_error(campaign: Campaign, options: ComparedFigure, files: results.ResultFiles) -> Inputs:
    """The inputs of a figure of the error of the model: the campaign has the materials, which have their colours."""
    return {"campaign": files.path(results.DATASET), "model_error": files.path(results.MODEL_ERROR)}
