"""State which runs a mean, range, index or curve leaves out, and whether the rest of the runs is a biased selection.

Every place that shows a number of several runs uses the words of `LeftOut`. If runs are left out for reasons that
depend on what was varied, the other runs are a biased selection: for example, if the runs with the strongest adhesion
fail, the mean of the others is that of weaker adhesion. Then the number is marked. If more than a tenth of the runs is
left out for such reasons, no interval is stated, because intervals assume that the runs are a random selection.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from icha.contact.models import MODELS
from icha.datasets.labels import LABELS
from icha.datasets.variables.campaign import (
    FAILED_CHECKS,
    FAILED_LOSS,
    INCOMPLETE,
    MISSING,
    NOT_IN_DESIGN,
)
from icha.datasets.variables.terms import MATERIAL
from icha.support.formatting import choose_unit

if TYPE_CHECKING:
    import xarray as xr

# Largest part of the runs that may be left out, for reasons that depend on what was varied, if an interval is stated.
MOST_LEFT_OUT = 0.1
# A parameter separates the runs that are left out from the others if a difference of their ranks that is at least as
# large is less probable than this value (Mann and Whitney's test), or if the two ranges do not overlap.
_PROBABILITY = 0.05

# Causes. The words hold for one run and for several runs.
FAILED, NOT_FINISHED, NOT_COMPUTED = "failed a check", "did not finish", "not computed"
NOT_REQUESTED, NOT_COMPARED = "not requested", "not compared"
LOSS_FAILED, ENDED_EARLY = "failed a check of the loss", "ended before this state"
ENDED_FIRST = "ended before the first target"
NOT_APPLICABLE, NOT_POSITIVE, INFINITE = "outside the range of the model", "without a positive value", "in full contact"
NO_FIT = "without a fit of JKR"
_OF_STATUS = {INCOMPLETE: NOT_FINISHED, FAILED_CHECKS: FAILED, MISSING: NOT_COMPUTED}
WITHOUT_RUN = (NOT_COMPUTED, NOT_REQUESTED)
# Causes in the physics of a run, which depends on everything that was varied, and thus on the seed. Whether a run fails
# in another way depends on a parameter if this parameter separates the failed runs from the others.
_PHYSICS = (LOSS_FAILED, ENDED_EARLY, ENDED_FIRST, NOT_APPLICABLE, NOT_POSITIVE, INFINITE, NO_FIT)


class LeftOut(NamedTuple):
    """The runs that a number leaves out.

    Attributes
    ----------
    things : noun for the runs in the plural, such as `cases` or `seeds`.
    wanted : number of runs that were requested.
    used : number of runs that the number contains.
    causes : number of runs that are left out, by cause.
    separated : words for the parameter that separates these runs from the others; empty if there is none.
    dependent : number of runs that are left out for reasons that depend on what was varied.
    """

    things: str
    wanted: int
    used: int
    causes: Mapping[str, int] = {}
    separated: str = ""
    dependent: int = 0

    @property
    def words(self) -> str:
        """Numbers and causes, such as `9 of 16 cases; 7 failed a check, all with …`; empty if no run is left out."""
        if self.used == self.wanted:
            return ""
        causes = ", ".join(f"{count} {cause}" for cause, count in self.causes.items())
        return f"{self.used} of {self.wanted} {self.things}; {causes}{self.separated}"

    @property
    def biased(self) -> bool:
        """Whether the runs that are used are a biased selection."""
        return self.dependent > 0

    @property
    def has_interval(self) -> bool:
        """Whether an interval may be stated."""
        return self.dependent <= MOST_LEFT_OUT * self.wanted

    @property
    def sentence(self) -> str:
        """The words, with what they mean for a range or an interval; empty if no run is left out."""
        if not self.words:
            return ""
        if self.has_interval:
            return f"{self.words}; biased" if self.biased else self.words
        return f"{self.words}; biased, so no interval is stated"


def too_few(used: np.ndarray, wanted: int | np.ndarray) -> np.ndarray:
    """Return whether means over `used` of `wanted` seeds have no interval, because their causes are not known here."""
    return np.asarray(wanted) - used > MOST_LEFT_OUT * np.asarray(wanted)


def find_left_out(things: str, causes: Sequence[str], parameters: Mapping[str, tuple[str, np.ndarray]] = {}) -> LeftOut:
    """Describe the runs that a number leaves out.

    Parameters
    ----------
    things : noun for the runs in the plural.
    causes : for each run, the cause why it is left out; empty for a run that is used. Runs that were not requested
        do not count.
    parameters : unit, and value for each run, of everything that was varied, by name.
    """
    causes = np.asarray(causes, object)
    requested = causes != NOT_REQUESTED
    causes = causes[requested]
    parameters = {name: (unit, np.asarray(values, float)[requested]) for name, (unit, values) in parameters.items()}
    used = causes == ""
    counts = Counter(causes[~used].tolist())
    failed = ~used & (causes != NOT_COMPUTED)
    separated = _separation(failed, used, parameters) if failed.any() and used.any() else ""
    dependent = sum(
        count for cause, count in counts.items() if cause in _PHYSICS or (separated and cause != NOT_COMPUTED)
    )
    return LeftOut(things, len(causes), int(used.sum()), dict(counts), separated, dependent)


def _separation(failed, used, parameters):
    """Return words for the parameter that best separates failed from used runs; empty if no parameter does."""
    from scipy.stats import mannwhitneyu  # imported here because most means leave out no run

    best, words = math.inf, ""
    for name, (unit, values) in parameters.items():
        those, others = values[failed], values[used]
        probability = float(mannwhitneyu(those, others).pvalue)
        apart = those.min() > others.max() or those.max() < others.min()
        if (probability < _PROBABILITY or apart) and probability < best:
            best, above = probability, np.median(those) > np.median(others)
            size, edge = ("large", those.min()) if above else ("small", those.max())
            words = f", mostly with {size} {name.replace('_', ' ')}"
            if (others < edge).any() if above else (others > edge).any():
                every, side = "all with" if len(those) > 1 else "with", "above" if above else "below"
                words = f", {every} {name.replace('_', ' ')} {side} {_round(edge, unit, up=not above)}"
    return words


def _round(value, unit, *, up):
    """Format a bound with two digits; it lies strictly above (`up`) or below the given value."""
    factor, prefixed = (1.0, "") if unit == "1" else choose_unit(value, unit)
    step = 10.0 ** (math.floor(math.log10(abs(value * factor))) - 1) if value else 1.0
    steps = value * factor / step
    # Rounding of the last bit must not make the bound equal to the value.
    rounded = (math.ceil(steps + 1e-9) if up else math.floor(steps - 1e-9)) * step
    return f"{rounded:.6g} {prefixed}".strip()


def causes_of_runs(runs: xr.Dataset, values: xr.DataArray | None = None, *, of_loss: bool = False) -> xr.DataArray:
    """Return why each run has no value, as texts along its labels; empty with a value, NOT_REQUESTED without a run.

    Parameters
    ----------
    runs : study of a campaign dataset, or a part of it.
    values : value of each run, with NaN where a run has none. None: every run has a value that did not fail and that
        reached its first target.
    of_loss : whether the values are losses, which runs with failed checks of the loss do not have.
    """
    from icha.datasets.campaign import loading_stops  # imports xarray, which takes time

    status = runs["status"]
    causes = status.copy(data=np.full(status.shape, "", object))
    for number, cause in (_OF_STATUS | ({FAILED_LOSS: LOSS_FAILED} if of_loss else {})).items():
        causes = causes.where(status != number, cause)
    if values is None and "step_kind" in runs:
        causes = causes.where((causes != "") | loading_stops(runs).any("step"), ENDED_FIRST)
    elif values is not None:
        if "applicability" in runs:  # not in campaigns of earlier versions
            causes = causes.where((causes != "") | (runs["applicability"] == ""), NOT_APPLICABLE)
        causes = causes.where((causes != "") | values.notnull(), ENDED_EARLY)
    return causes.where(status != NOT_IN_DESIGN, NOT_REQUESTED)


def left_out_of_study(
    study: xr.Dataset, shown: xr.DataArray | None = None, wanted: xr.DataArray | None = None
) -> LeftOut:
    """Describe the runs of a study that failed, are missing, or ended before a state.

    Parameters
    ----------
    study : study of a campaign dataset.
    shown : True for the runs that reach the state (`icha.datasets.campaign`). A run that reached the end of its path
        and is not shown failed a check of its loss. None: the state is the first target.
    wanted : True for the runs that count; None for all runs.
    """
    causes = _causes_at_state(study, shown, wanted).transpose(*LABELS).values.ravel()
    return find_left_out("runs", causes, varied_parameters(study, LABELS))


def _causes_at_state(study, shown, wanted):
    """Return the causes of `causes_of_runs` at the state of `left_out_of_study`."""
    causes = causes_of_runs(study)
    if shown is not None:
        causes = causes.where((causes != "") | shown | (study["status"] != FAILED_LOSS), LOSS_FAILED)
        causes = causes.where((causes != "") | shown, ENDED_EARLY)
    return causes if wanted is None else causes.where(wanted, NOT_REQUESTED)


def absent_materials(
    study: xr.Dataset, shown: xr.DataArray | None = None, wanted: xr.DataArray | None = None
) -> list[str]:
    """Describe each model and material of a study whose runs all are left out, with causes and one reason.

    Parameters are those of `left_out_of_study`.
    """
    causes, found = _causes_at_state(study, shown, wanted), []
    for model, material in itertools.product(study["model"].values, study["material"].values):
        at = {"model": study["model"].values == model, "material": study["material"].values == material}
        left_out = find_left_out("runs", causes.isel(at).values.ravel())
        if left_out.wanted and not left_out.used:
            counted = ", ".join(f"{count} {cause}" for cause, count in left_out.causes.items())
            reason = next(filter(None, study["failure"].isel(at).values.ravel().tolist()), "")
            found.append(f"{material} with {MODELS[model].words} ({counted}{reason and f': {reason}'})")
    return found


def varied_parameters(runs: xr.Dataset, dims: Sequence[str]) -> dict[str, tuple[str, np.ndarray]]:
    """Return unit and values of all parameters that differ between the runs, as flat arrays of the runs along `dims`.

    runs : study of a campaign dataset, or a part of it.
    """
    asked = runs["status"].transpose(*dims).values.ravel() != NOT_IN_DESIGN
    names = [str(name) for name, each in runs.coords.items() if "varied" in each.attrs]
    found = {}
    for name in dict.fromkeys([*names, "rms_slope", *MATERIAL]):
        if name not in runs or runs[name].dtype.kind not in "fi":
            continue
        values = runs[name].broadcast_like(runs["status"]).transpose(*dims).values.ravel()
        if np.isfinite(values[asked]).all() and np.ptp(values[asked]) > 0:
            found[name] = runs[name].attrs["units"], values
    return found
