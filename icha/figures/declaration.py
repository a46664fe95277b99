"""The declaration of a figure: what a campaign may ask of it, and what it is drawn from.

A module `fig<number>_<words>` of this folder is a figure: it has a `DECLARATION` and a function `figure` that draws it.
Nothing else knows its name, for `icha.figures.registry` finds it. Reading a configuration imports all of them, so that
they import libraries for drawing, and modules that need xarray, only where they draw.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from icha.datasets import results
from icha.datasets.labels import ContactLabels, RunLabels, SolutionLabels, parts
from icha.support.values import Problem, Section


class Campaign(Protocol):
    """What of a configuration figures may ask for (`icha.configuration`): its sections, and its runs."""

    studies: Mapping[str, Any]
    materials: Mapping[str, Any]
    boundary_elements: Mapping[str, Any]
    boundary_element_loops: Mapping[str, Any]
    error_sources: Mapping[str, Any]
    measurements: Mapping[str, Any]

    def contacts(self, study: str) -> list[tuple[str, int, float, str]]:
        """Surface, seed, rms slope and material of every run of a study."""

    def solved(self, entry: Any) -> list[tuple[str, int, float, str]]:
        """The same of an entry beside a study."""

    def snapshots_of(self, study: str) -> list[tuple[str, float]] | None:
        """Kind and value of all states that the runs of a study keep; None where they keep their last one."""


@dataclass(frozen=True)
class ResultFiles:
    """Paths of the results of a campaign from which figures are drawn: its folder of results, and its name."""

    folder: str
    campaign: str

    def _path(self, pattern, **names) -> str:
        return f"{self.folder}/{pattern.format(campaign=self.campaign, **names)}"

    @property
    def dataset(self) -> str:
        """The campaign dataset."""
        return self._path(results.DATASET)

    @property
    def model_error(self) -> str:
        """The differences between the model and boundary elements."""
        return self._path(results.MODEL_ERROR)

    def surface(self, run: RunLabels) -> str:
        """Topography of a run."""
        return self._path(results.SURFACE, surface=run.surface, seed=run.seed)

    def theories(self, surface: str) -> str:
        """Theories for a surface."""
        return self._path(results.THEORIES, surface=surface)

    def solution(self, labels: SolutionLabels) -> str:
        """A boundary-element solution."""
        return self._path(results.SOLUTION, **parts(labels))

    def loop(self, labels: ContactLabels) -> str:
        """Boundary elements both ways."""
        return self._path(results.LOOP, **parts(labels))

    def error_sources(self, labels: ContactLabels) -> str:
        """A study of the sources of the model's error."""
        return self._path(results.ERROR_SOURCES, **parts(labels))


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
    return {"campaign": files.dataset}


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
