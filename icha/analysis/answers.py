"""The answers of a campaign in words: each estimate with its interval, what limits it, and what would narrow it."""

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.analysis.control_variates import PROBABILITY
from icha.analysis.estimates import LOOP
from icha.datasets import table
from icha.datasets.quantities import quantity, state_words
from icha.path.targets import OF_SQUARES, PER_NOMINAL_AREA

_LEVELS = {
    "asperity_seeds": "the asperity model",
    "coarse_seeds": "boundary elements on half the grid",
    "fine_seeds": "boundary elements",
}
# Largest ratio of half-width and absolute value of an interval that is printed with ±. Wider intervals need not be
# symmetric, so their ends are printed.
_WIDE = 0.3


class Answer(NamedTuple):
    """One estimate.

    Attributes
    ----------
    contact : text with surface, rms slope and material.
    state : text with the target of the state; empty for a quantity of a loop.
    quantity : name of the quantity in words.
    value, low, high : estimate and ends of its interval in `unit`; NaN if none is stated.
    unit : unit; "" for counts.
    shares : half-width in `unit` by cause: seeds, model, grid, inputs.
    note : text about runs that are left out, about seeds with full contact, and about an error of the grid that the
        interval does not contain; empty if there are none.
    limit : sentence that names what limits the accuracy.
    """

    contact: str
    state: str
    quantity: str
    value: float
    low: float
    high: float
    unit: str
    shares: dict[str, float]
    note: str
    limit: str

    @property
    def half_width(self) -> float:
        """Half-width of the interval."""
        return (self.high - self.low) / 2

    @property
    def _digits(self) -> int:
        """Number of decimal places of the estimate and its interval."""
        return max(0, 1 - math.floor(math.log10(self.half_width))) if self.half_width > 0 else 3

    @property
    def estimate(self) -> str:
        """Estimate with interval, as text; a wide interval as its two ends, and no interval if none is stated."""
        if math.isnan(self.value):
            return "no estimate"
        unit = f" {self.unit}" if self.unit else ""
        if math.isnan(self.half_width):
            return f"{self.value:.3g}{unit}"
        digits = self._digits
        interval = f" ± {self.half_width:.{digits}f}{unit}"
        if self.half_width > _WIDE * abs(self.value):
            interval = f", from {self.low:.{digits}f} to {self.high:.{digits}f}{unit}"
        return f"{self.value:.{digits}f}{unit}{interval}"

    @property
    def number(self) -> str:
        """Estimate with interval, the contributions to the interval, and the note, as text."""
        parts = ", ".join(f"{name} {part:.{self._digits}f}" for name, part in self.shares.items())
        return self.estimate + ("" if math.isnan(self.half_width) else f" ({parts})") + self.note


def answers_of(study: xr.Dataset) -> list[Answer]:
    """Return the answers of a study; `study` is a group of the dataset of `icha.analysis.estimates`.

    For surfaces that are single squares, such as lenses, quantities per nominal area are left out.
    """
    quantities, surfaces = study["quantity"].values, study["surface"].values
    squares = surfaces[np.isin(quantities, OF_SQUARES)]
    shown = ~(np.isin(quantities, PER_NOMINAL_AREA) & np.isin(surfaces, squares))
    return [_answer(study.isel(answer=k)) for k in np.flatnonzero(shown)]


def _answer(row: xr.Dataset) -> Answer:
    described, value = quantity(str(row["quantity"].item())), float(row["estimate"])
    factor, unit = described.in_unit(0.0 if math.isnan(value) else value)
    shares = {name: float(row[f"share_{name}"]) for name in ("seeds", "model", "refinement", "grid", "inputs")}
    known = {name: 0.0 if math.isnan(share) else share for name, share in shares.items()}
    causes = {"seeds": math.hypot(known["seeds"], known["refinement"])}
    if row["asperity_seeds"]:
        causes["model"] = known["model"]
    if not math.isnan(shares["grid"]):
        causes["grid"] = known["grid"]
    if not math.isnan(shares["inputs"]):
        causes["inputs"] = known["inputs"]
    kind = str(row["stop_kind"].item())
    notes = [str(row["left_out"].item()) if "left_out" in row else ""]  # not in results of earlier versions
    if row["full_contact_seeds"]:
        notes.append(f"full contact in {int(row['full_contact_seeds'])} of {int(row['fine_seeds'])} seeds")
    notes.append(str(row["grid_error"].item()) if "grid_error" in row else "")
    return Answer(
        f"{row['material'].item()} on {row['surface'].item()}, h'rms = {float(row['rms_slope']):.4g}",
        "" if kind == LOOP else state_words(kind, float(row["stop_target"])),
        described.name,
        value * factor,
        float(row["estimate_low"]) * factor,
        float(row["estimate_high"]) * factor,
        unit,
        {name: share * abs(value) * factor for name, share in causes.items()},
        "".join(f"; {note}" for note in notes if note),
        _limit(row, shares),
    )


def _limit(row, shares):
    """Return a sentence on what limits the accuracy, and how the interval would narrow with twice as many seeds."""
    if math.isnan(float(row["estimate_low"])):
        return "The runs that are left out limit the accuracy."
    sources = {"asperity_seeds": "seeds", "coarse_seeds": "model", "fine_seeds": "refinement"}
    present = {level: int(row[level]) for level in sources if int(row[level])}
    cheapest, *others = present
    variances = {cheapest: shares["seeds"] ** 2} | {
        level: shares["model" if cheapest == "asperity_seeds" and level == others[0] else "refinement"] ** 2
        for level in others
    }
    grid = 0.0 if math.isnan(shares["grid"]) else shares["grid"] ** 2
    inputs = 0.0 if math.isnan(shares["inputs"]) else shares["inputs"] ** 2
    total = sum(variances.values()) + grid + inputs
    if inputs > max(*variances.values(), grid):
        return (
            f"The sampled parameters limit the accuracy: ± {100 * math.sqrt(inputs):.2g} % of the value. Better known "
            "parameters would narrow it; more seeds would not."
        )
    if not total:
        return "The seeds do not differ, and no other error is known."
    if grid > max(variances.values()):
        return (
            f"The grid limits the accuracy: ± {100 * math.sqrt(grid):.2g} % of the value. A finer grid would narrow it."
        )
    level = max(variances, key=variances.__getitem__)
    narrower = math.sqrt((total - variances[level] / 2) / total)
    unknown = " The error of the grid is unknown." if math.isnan(shares["grid"]) else ""
    return (
        f"The {present[level]} seeds of {_LEVELS[level]} limit the accuracy: with twice as many, the interval would be "
        f"{100 * (1 - narrower):.0f} % narrower.{unknown}"
    )


def paragraph(name: str, answers: list[Answer]) -> str:
    """Return one paragraph on the answers of a study: the last state of each contact, and what limits it."""
    found = []
    for contact in dict.fromkeys(each.contact for each in answers):
        of_contact = [each for each in answers if each.contact == contact]
        state = next((each.state for each in reversed(of_contact) if each.state), "")
        main = [each for each in of_contact if each.state in (state, "")][:2]
        numbers = "; ".join(f"{each.quantity} {each.number}" for each in main)
        at = f" at {state}" if state else ""
        found.append(f"{contact}{at}: {numbers}. {main[0].limit}")
    inputs = " They include the scatter of the sampled parameters." if "inputs" in answers[0].shares else ""
    return (
        f"{name}: "
        + " ".join(found)
        + f" Intervals contain the mean over all realisations in {100 * PROBABILITY:g} % of cases.{inputs}"
    )


def as_csv(answers: xr.DataTree) -> str:
    """Return all answers as a table in CSV, with one line of names."""
    import pandas as pd

    frames = {
        study: pd.DataFrame({name: v.values for name, v in node.data_vars.items()})
        for study, node in answers.children.items()
    }
    return table.as_csv(pd.concat(frames, names=["study"]).reset_index(level="study"))


def as_latex(answers: xr.DataTree) -> Iterator[str]:
    """Yield the lines of a LaTeX table (booktabs) for each study."""
    for study, node in answers.children.items():
        yield f"% study {study}"
        yield r"\begin{tabular}{llll}"
        yield r"\toprule contact & state & quantity & estimate \\ \midrule"
        for each in answers_of(node.to_dataset()):
            # A hyphen in text mode would look shorter than a minus sign; exponents such as 1e-05 stay.
            estimate = re.sub(r"(?<!e)-", "$-$", each.estimate)
            number = f"{estimate}{each.note}".replace("%", r"\%").replace("±", r"$\pm$")
            cells = [text.replace("_", r"\_").replace("'", "$'$") for text in (each.contact, each.state, each.quantity)]
            yield " & ".join([*cells, number]) + r" \\"
        yield r"\bottomrule"
        yield r"\end{tabular}"
