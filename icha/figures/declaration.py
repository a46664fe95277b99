"""The declaration of a figure: what a campaign may ask of it, and what it is drawn from.

A module `fig<number>_<words>` of this folder is a figure: it has a `DECLARATION` and a function `figure` that draws it.
Nothing else knows its name, for `icha.figures.registry` finds it. Reading a configuration imports all of them, so that
they import libraries for drawing, and modules that need xarray, only where they draw.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from icha.datasets.results import DATASET, ResultFiles
from icha.support.values import Problem, Section


class Campaign(Protocol):
    """What of a configuration figures may ask for (`icha.configuration`): its sections, and its runs."""

    studies: Mapping[str, Any]
    materials: Mapping[str, Any]
    finite_range: Mapping[str, Any]
    boundary_element_loops: Mapping[str, Any]
    measurements: Mapping[str, Any]

    def contacts(self, study: str) -> list[tuple[str, int, float, str]]:
        """Surface, seed, rms slope and material of every run of a study."""

    def solved(self, entry: Any) -> list[tuple[str, int, float, str]]:
        """The same of an entry beside a study."""

    def compares_models(self, study: str) -> bool:
        """Whether the runs of a study by asperities have others by boundary elements beside them at given loads."""

    def snapshots_of(self, study: str) -> list[tuple[str, float]] | None:
        """Kind and value of all states that the runs of a study keep; None where they keep their last one."""


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


def dataset_only(campaign: Campaign, options: FigureOptions, files: ResultFiles) -> Inputs:
    """The inputs of a figure of the campaign dataset alone."""
    return {"campaign": files.path(DATASET)}


@dataclass(frozen=True)
class Declaration:
    """What a figure is, but for its drawing.

    Parameters
    ----------
    description : what it shows, in a line, for those who write configurations.
    caption : what it shows, for those who look at it; printed in the report.
    options : the model of its section; its first line of documentation is part of the schema.
    inputs : the files of its arguments. Results are read; of other files the paths are handed over.
    arguments : arguments that the rest of the configuration gives, beside those of the options.
    holds_topography : whether it takes memory for arrays of the surface's size.
    """

    description: str
    caption: str
    options: type[FigureOptions]
    inputs: Callable[[Campaign, Any, ResultFiles], Inputs] = dataset_only
    arguments: Callable[[Campaign, Any], dict[str, Any]] = lambda campaign, options: {}
    holds_topography: bool = False
