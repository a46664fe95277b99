"""What a run of a campaign is called."""

from __future__ import annotations

from typing import NamedTuple


class RunLabels(NamedTuple):
    """Which run of a campaign: names of study, surface and material, seed, and rms slope as configured."""

    study: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Where the run's dataset stands among the runs, without the ending."""
        slope = number_label(self.rms_slope)
        return f"{self.study}/{self.surface}/seed{self.seed}/slope{slope}/{self.material}"

    def __str__(self):
        """The run's place among the runs."""
        return self.path


class ContactLabels(NamedTuple):
    """What an entry beside a study asks for: the entry, and what is pressed against what."""

    entry: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Where its file stands among the others, without the ending."""
        return f"{self.entry}/{self.surface}/seed{self.seed}/slope{number_label(self.rms_slope)}/{self.material}"


class SolutionLabels(NamedTuple):
    """Which boundary-element solution of a campaign: the entry that asks for it, the run beside it, and its load."""

    entry: str
    study: str
    surface: str
    seed: int
    rms_slope: float
    material: str
    reduced_pressure: float

    @property
    def run(self) -> RunLabels:
        """The run that is compared with it."""
        return RunLabels(*self[1:6])

    @property
    def path(self) -> str:
        """Where its file stands among the solutions, without the ending."""
        slope, pressure = number_label(self.rms_slope), number_label(self.reduced_pressure)
        return f"{self.entry}/{self.surface}/seed{self.seed}/slope{slope}/{self.material}/p{pressure}"

    def __str__(self):
        """The solution's place among the solutions."""
        return self.path


def number_label(value: float) -> str:
    """The shortest text that reads back as `value`: 0.2 is `0.2`, 1.0 is `1`."""
    return repr(float(value)).removesuffix(".0")
