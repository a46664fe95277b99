"""The answers of a campaign in words: each estimate with its interval, what limits it, and what would narrow it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from icha.datasets.quantities import quantity, state_words
from icha.path.targets import OF_SQUARES, PER_NOMINAL_AREA
from icha.report.tables import Table
from icha.support.formatting import format_quantity
from icha.uncertainty.control_variates import LEVELS, PROBABILITY, SEEDS, quantile, share_of_levels
from icha.uncertainty.distributions import KINDS
from icha.uncertainty.estimates import LOOP
from icha.uncertainty.sensitivity import response_words

# Largest ratio of half-width and absolute value of an interval that is printed with ±. Wider intervals need not be
# symmetric, so their ends are printed.
_WIDE = 0.1


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
    mean : "geometric" or "arithmetic", the kind of mean over the seeds.
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
    mean: str

    @property
    def half_width(self) -> float:
        """Half-width of the interval."""
        return (self.high - self.low) / 2

    @property
    def relative_half_width(self) -> float:
        """Half-width divided by the magnitude of the estimate; infinite without an interval."""
        return np.inf if math.isnan(self.half_width) or not self.value else self.half_width / abs(self.value)

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
        if not self.half_width:
            return f"{self.value:.4g}{unit} in every run"
        digits = self._digits
        interval = f" ± {self.half_width:.{digits}f}{unit}"
        if self.half_width > _WIDE * abs(self.value):
            interval = f", from {self.low:.{digits}f} to {self.high:.{digits}f}{unit}"
        return f"{self.value:.{digits}f}{unit}{interval}"

    @property
    def number(self) -> str:
        """Estimate with interval, the contributions to the interval, and the note, as text."""
        parts = ", ".join(f"{name} {part:.{self._digits}f}" for name, part in self.shares.items())
        return self.estimate + (f" ({parts})" if self.half_width > 0 else "") + self.note


def answers_of(study: xr.Dataset) -> list[Answer]:
    """Return the answers of a study; `study` is a group of the dataset of `icha.uncertainty.estimates`.

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
    causes = {"seeds": np.hypot(*np.nan_to_num([shares["seeds"], shares["refinement"]]))}
    causes |= {"model": np.nan_to_num(shares["model"])} if row["asperity_seeds"] else {}
    causes |= {name: shares[name] for name in ("grid", "inputs") if not math.isnan(shares[name])}
    kind = str(row["stop_kind"].item())
    notes = [str(row["left_out"].item())]
    if row["full_contact_seeds"]:
        notes.append(f"full contact in {int(row['full_contact_seeds'])} of {int(row['fine_seeds'])} seeds")
    notes.append(str(row["grid_error"].item()))
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
        "geometric" if row["geometric"] else "arithmetic",
    )


def _limit(row, shares):
    """Return a sentence on what limits the accuracy, and how the interval would narrow with twice as many seeds."""
    if math.isnan(float(row["estimate_low"])):
        return "The runs that are left out limit the accuracy."
    causes = share_of_levels([level for level, name in SEEDS.items() if row[name]])
    variances = {level: shares[cause] ** 2 for level, cause in causes.items()}
    variances |= {cause: 0.0 if math.isnan(shares[cause]) else shares[cause] ** 2 for cause in ("grid", "inputs")}
    total, level = sum(variances.values()), max(variances, key=variances.__getitem__)
    if not total:
        return "The seeds do not differ, which gives no interval, and no other error is known."
    width = f"± {100 * math.sqrt(variances[level]):.2g} % of the value"
    if level == "inputs":
        return (
            f"The sampled parameters limit the accuracy: {width}. Better known parameters would narrow it; more seeds "
            "would not."
        )
    if level == "grid":
        return f"The grid limits the accuracy: {width}. A finer grid would narrow it."
    seeds, freedom = int(row[SEEDS[level]]), float(row["degrees_of_freedom"])
    of_more = quantile(freedom * (2 * seeds - 1) / max(seeds - 1, 1)) / quantile(freedom)
    narrower = 1 - of_more * math.sqrt((total - variances[level] / 2) / total)
    unknown = " The error of the grid is unknown." if math.isnan(shares["grid"]) else ""
    return (
        f"The {seeds} seeds of {LEVELS[level]} limit the accuracy: with twice as many, the interval would "
        f"be {100 * narrower:.0f} % narrower.{unknown}"
    )


def sentences(answers: list[Answer]) -> list[str]:
    """Return sentences on the answers of a study: the last state of each contact and what limits it; the intervals."""
    found = []
    for contact in dict.fromkeys(each.contact for each in answers):
        of_contact = [each for each in answers if each.contact == contact]
        state = next((each.state for each in reversed(of_contact) if each.state), "")
        main = [each for each in of_contact if each.state in (state, "")][:2]
        numbers = "; ".join(f"{each.quantity} {each.number}" for each in main)
        widest = max(main, key=lambda each: each.relative_half_width)
        found.append(f"{contact}{f' at {state}' if state else ''}: {numbers}. {widest.limit}")
    inputs = " They include the scatter of the sampled parameters." if "inputs" in answers[0].shares else ""
    return [*found, f"Intervals contain the mean over all realisations in {100 * PROBABILITY:g} % of cases.{inputs}"]


def answers_table(answers: list[Answer]) -> Table:
    """Return the table of the answers of a study."""
    rows = [(each.contact, each.state, each.quantity, each.mean, each.number) for each in answers]
    return Table("All estimates (causes of the half-width)", ("contact", "state", "quantity", "mean", "estimate"), rows)


def samples_table(data: xr.Dataset) -> Table:
    """Return the table of the results of sampled cases: middle, range, and what share each parameter causes."""
    rows = []
    for k in range(data.sizes.get("response", 0)):
        row = data.isel(response=k)
        factor, unit = quantity(str(row["response_quantity"].item())).in_unit(float(row["middle"]))
        low, middle, high = (f"{float(f'{float(row[name]) * factor:.3g}'):g}" for name in ("low", "middle", "high"))
        biased, error = " (biased)" if row["biased"] else "", float(row["unexplained"])
        halves = ("" if math.isnan(half) else f" ± {100 * half:.0f}" for half in row["first_order_half_width"].values)
        shares = (
            "" if math.isnan(share) else f"{100 * share:.0f}{half} %{biased}"
            for share, half in zip(row["first_order"].values, halves, strict=True)
        )
        rows.append(
            (
                response_words(data, row),
                str(int(row["case_count"])),
                f"{middle} {unit}".strip() + biased,
                "not stated" if low == "nan" else f"{low} to {high} {unit}".strip() + biased,
                *shares,
                "" if math.isnan(error) else f"{100 * min(error, 1):.2g} %",
            )
        )
    names = (quantity(name).name for name in data["parameter"].values.tolist())
    return Table(
        "Columns of parameters: share of the variance of the logarithm that the parameter alone causes",
        ("result", "cases", "middle", "90 % of cases", *names, "unexplained"),
        rows,
    )


def distribution_words(data: xr.Dataset, name: str) -> str:
    """Describe the distribution of a parameter, such as `Hurst exponent: uniform, lower end 0.5, upper end 0.9`."""
    attributes = data[name].attrs
    kind, numbers = attributes["distribution"], attributes["distribution_numbers"]
    units = (attributes["units"], "1" if kind == "lognormal" else attributes["units"])
    texts = (f"{n:g}" if unit == "1" else format_quantity(n, unit) for n, unit in zip(numbers, units, strict=True))
    described = ", ".join(f"{words} {text}" for words, text in zip(KINDS[kind], texts, strict=True))
    return f"{quantity(name).name}: {kind}, {described}"
