"""Tables of the report: runs that failed, parameters, checks and answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.analysis.answers import Answer
from icha.analysis.checks import worst
from icha.analysis.left_out import left_out_of_study
from icha.analysis.sample_words import sample_rows
from icha.checks.findings import Check
from icha.contact.models import MODELS
from icha.datasets.campaign import run_place, runs_of_status
from icha.datasets.labels import RunLabels, slopes_of
from icha.datasets.surface_file import measured_scale
from icha.datasets.variables.campaign import BEYOND_MODEL, COMPUTED_RUNS, FAILED_RUNS, LOADED_RUNS, MISSING
from icha.report.template import format_symbols
from icha.support.formatting import format_quantity, printable

_COUNTED = {
    "requested": (*COMPUTED_RUNS, MISSING),
    "complete": LOADED_RUNS,
    "beyond_model": (BEYOND_MODEL,),
    "failed": FAILED_RUNS,
    "missing": (MISSING,),
}
_MOST_VALUES = 12  # largest number of values in a cell


class Table(NamedTuple):
    """A table of the page.

    Attributes
    ----------
    caption : text above the table.
    head : titles of the columns.
    rows : texts of the cells.
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[object]]


def count_runs(study: xr.Dataset) -> Counter[str]:
    """Count the runs of a study by the names in `_COUNTED`."""
    return Counter({name: int(np.isin(study["status"], kinds).sum()) for name, kinds in _COUNTED.items()})


def failures(studies: Mapping[str, xr.Dataset], folder: str | None) -> tuple[list[str], Table]:
    """Return sentences that count failed runs, and a table of the runs that means leave out, with the reasons.

    Parameters
    ----------
    studies : datasets of the studies, by name.
    folder : folder of the runs, for links to their files; None for texts without links.
    """
    sentences = [
        f"Study {name}: {words}."
        for name, study in studies.items()
        if (words := left_out_of_study(study, of_loss=True).words)
    ]
    rows = []
    for name, study in studies.items():
        failed = runs_of_status(study, name, FAILED_RUNS)
        rows += [(_run(run, folder), "failed", _reason(study, "failure", run) or "incomplete") for run in failed]
        rows += [(_run(run), "missing", "") for run in runs_of_status(study, name, (MISSING,))]
        rows += [
            (_run(run, folder), "model not applicable", reason)
            for run in runs_of_status(study, name, LOADED_RUNS)
            if (reason := _reason(study, "applicability", run))
        ]
    return sentences, Table("Runs that are not part of means", ("run", "", "reason"), rows)


def _run(run: RunLabels, folder: str | None = None) -> str:
    """Name a run in words, with a link to its file if `folder` is given."""
    words = f"{run.study}: {run.surface}, seed {run.seed}, slope {run.rms_slope:g}, {run.material}, "
    words = printable(words + MODELS[run.model].words)
    return Markup('<a href="{}/{}.nc">{}</a>').format(folder, run.path, words) if folder else words


def _reason(study: xr.Dataset, name: str, run: RunLabels) -> str:
    """Return the text of `failure` or `applicability` of a run; empty text if the dataset has no such variable."""
    return str(study[name].isel(run_place(study, run)).item()) if name in study else ""


def studies_table(studies: Mapping[str, xr.Dataset]) -> Table:
    """Return the table of the studies: numbers of runs, and values of the labels."""
    rows = []
    for name, study in studies.items():
        runs, slopes = count_runs(study), [f"{slope:g}" for slope in slopes_of(study)]
        labels = (study[label].values.tolist() for label in ("surface", "seed", "material"))
        surfaces, seeds, materials = map(_list, labels)
        models = ", ".join(MODELS[model].words for model in study["model"].values)
        rows.append(
            (name, f"{runs['complete']} of {runs['requested']}", surfaces, seeds, _list(slopes), materials, models)
        )
    return Table("Studies", ("study", "complete runs", "surfaces", "seeds", "rms slopes", "materials", "models"), rows)


def _list(values: list) -> str:
    """List the first values, and the number of all values if there are more."""
    more = f", … ({len(values)})" if len(values) > _MOST_VALUES else ""
    return ", ".join(map(str, values[:_MOST_VALUES])) + more


def materials_table(studies: Mapping[str, xr.Dataset]) -> Table:
    """Return the table of all materials."""
    units = {"contact_modulus": "Pa", "surface_energy": "J/m²", "interaction_range": "m"}
    rows = {}
    for study in studies.values():
        for material in study["material"].values.tolist():
            values = study.sel(material=material)
            found = (_format(values[name].item(), unit) for name, unit in units.items())
            rows[material] = (material, *found)
    return Table("Materials", ("material", "contact modulus E*", "work of adhesion", "range"), list(rows.values()))


def _format(value: float, unit: str) -> str:
    """Format a quantity; a value that is missing or infinite is a dash."""
    if not np.isfinite(value):
        return "–"
    return format_quantity(value, unit) if unit else f"{value:.4g}"


def surfaces_table(surfaces: Iterable[xr.Dataset]) -> Table:
    """Return a table of the surfaces with the ranges of their statistics over the seeds, as measured for scans."""
    seeds: dict[str, list[xr.Dataset]] = {}
    for surface in surfaces:
        seeds.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    # Variable, unit, and power with which the value scales with the heights; -1 also stands for the reciprocal.
    columns = {
        "period": ("period", "m", 0),
        "roll-off": ("rolloff_wavelength", "m", 0),
        "short cut-off": ("short_wavelength", "m", 0),
        "Hurst exponent": ("hurst", "", 0),
        "rms slope": ("rms_slope", "", 1),
        "rms height": ("rms_height", "m", 1),
        "1/rms curvature": ("rms_curvature", "m", -1),
        "Nayak’s parameter": ("nayak_parameter", "", 0),
    }
    rows = []
    for name, members in seeds.items():
        cells = []
        for variable, unit, power in columns.values():
            values = [
                (float(each[variable]) * measured_scale(each) or np.nan) ** power if power else float(each[variable])
                for each in members
                if variable in each
            ]
            ends = (_format(value, unit) for value in (min(values), max(values))) if values else ("–",)
            cells.append(" to ".join(dict.fromkeys(ends)))
        first = members[0]
        boundary, grid = first.attrs.get("boundary", "periodic"), f"{int(first['grid'])}²"
        rows.append((name, _list(sorted(int(each["seed"]) for each in members)), boundary, grid, *cells))
    caption = "Surfaces, as measured or at the rms slope of the file. Studies scale the heights to their rms slopes"
    return Table(caption, ("surface", "seeds", "boundary", "grid", *columns), rows)


def sources_table(surfaces: Iterable[xr.Dataset]) -> Table:
    """Return the table of measured surfaces: file, checksum and preparation."""
    keys = ("surface", "source_file", "source_sha256", "preparation")
    rows = [tuple(each.attrs.get(key, "") for key in keys) for each in surfaces if "source_file" in each.attrs]
    return Table("Measured topographies", ("surface", "file", "SHA-256", "preparation"), list(dict.fromkeys(rows)))


def checks_tables(checks: Sequence[Check]) -> list[Table]:
    """Return the table with the worst value of each kind of check, and the table of all checks that failed."""
    head = ("check", "quantity", "value", "limit", "", "run")
    tables = {"Worst value of each check": worst(checks), "Failed": [check for check in checks if not check.passed]}
    return [Table(caption, head, list(map(_check, found))) for caption, found in tables.items()]


def _check(check: Check) -> tuple:
    mark = '<span class="good">✓ passed</span>' if check.passed else '<span class="bad">✗ failed</span>'
    value = "not finite" if check.value < 0 else f"{check.value:.3g}"
    return check.name, format_symbols(check.description), value, f"{check.limit:g}", Markup(mark), check.subject


def answers_table(answers: Sequence[Answer]) -> Table:
    """Return the table of the answers of a study."""
    rows = [(each.contact, each.state, each.quantity, each.number) for each in answers]
    return Table("All estimates (causes of the half-width)", ("contact", "state", "quantity", "estimate"), rows)


def samples_table(data: xr.Dataset) -> Table:
    """Return the table of the results of sampled cases."""
    parameters = [name.replace("_", " ") for name in data["parameter"].values.tolist()]
    rows = [
        (row["result"], row["cases"], row["middle"], row["range"], *row["shares"], row["unexplained"])
        for row in sample_rows(data)
    ]
    return Table(
        "Ranges contain 90 % of the cases. Shares are those of the variance of the logarithm of a result that a "
        "parameter causes alone (first-order index), with intervals of 90 %.",
        ("result", "cases", "middle", "range", *parameters, "unexplained"),
        rows,
    )
