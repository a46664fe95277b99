"""Names of the runs of a campaign, and of what is computed beside them."""

from typing import NamedTuple

from icha.contact.models import ASPERITIES

# Where their files stand among others of their kind, without the ending; in braces what differs from one to the next.
RUN = "{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}"
CONTACT = "{entry}/{surface}/seed{seed}/slope{slope}/{material}"
SOLUTION = CONTACT + "/p{pressure}"


def model_folder(model: str) -> str:
    """What stands before the name of a run's file: the model in a folder of its own, but for asperities."""
    return "" if model == ASPERITIES else f"{model}/"


class RunLabels(NamedTuple):
    """Which run of a campaign: names of study, model, surface and material, seed, and rms slope as configured."""

    study: str
    model: str
    surface: str
    seed: int
    rms_slope: float
    material: str

    @property
    def path(self) -> str:
        """Where the run's dataset stands among the runs, without the ending."""
        return RUN.format(**parts(self))

    def __str__(self):
        """The run's place among the runs."""
        return self.path


# Those of them that a study has as dimensions.
LABELS = RunLabels._fields[1:]


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
        return CONTACT.format(**parts(self))


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
        """The run that is compared with it, one of asperities."""
        return RunLabels(self.study, ASPERITIES, *self[2:6])

    @property
    def path(self) -> str:
        """Where its file stands among the solutions, without the ending."""
        return SOLUTION.format(**parts(self))

    def __str__(self):
        """The solution's place among the solutions."""
        return self.path


_NUMBERS = {"rms_slope": "slope", "reduced_pressure": "pressure"}


def parts(labels: RunLabels | ContactLabels | SolutionLabels) -> dict[str, str]:
    """What stands in the braces of a path."""
    found = {
        _NUMBERS.get(name, name): number_label(value) if name in _NUMBERS else str(value)
        for name, value in labels._asdict().items()
    }
    return found | ({"model_folder": model_folder(labels.model)} if isinstance(labels, RunLabels) else {})


def number_label(value: float) -> str:
    """The shortest text that reads back as `value`: 0.2 is `0.2`, 1.0 is `1`."""
    return repr(float(value)).removesuffix(".0")
