"""Tables of the report: runs that failed, parameters, checks and answers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.analysis.checks import worst
from icha.checks.findings import Check
from icha.contact.models import MODELS
from icha.datasets.campaign import run_place, runs_of_status, runs_with_loop
from icha.datasets.labels import RunLabels, slopes_of
from icha.datasets.quantities import quantity
from icha.datasets.surface_file import measured_scale
from icha.datasets.variables.campaign import BEYOND_MODEL, COMPUTED_RUNS, FAILED_RUNS, LOADED_RUNS, MISSING
from icha.report.template import format_symbols
from icha.support.formatting import format_quantity, list_first, printable
from icha.uncertainty.left_out import left_out_of_study

_COUNTED = {
    "requested": (*COMPUTED_RUNS, MISSING),
    "complete": LOADED_RUNS,
    "beyond_model": (BEYOND_MODEL,),
    "failed": FAILED_RUNS,
    "missing": (MISSING,),
}


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

    def as_text(self) -> str:
        """Return the table for a terminal."""
        lines = [list(map(printable, row)) for row in (self.head, *self.rows)]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        cells = ([text.ljust(width) for text, width in zip(line, widths, strict=True)] for line in lines)
        return "\n".join([self.caption, *(f"  {'  '.join(line)}".rstrip() for line in cells)])

    def as_latex(self) -> str:
        """Return the table for LaTeX (booktabs)."""
        head, *rows = (" & ".join(map(_latex, row)) + r" \\" for row in (self.head, *self.rows))
        columns = "l" * len(self.head)
        rules = [
            rf"\begin{{tabular}}{{{columns}}}",
            rf"\toprule {head} \midrule",
            *rows,
            r"\bottomrule",
            r"\end{tabular}",
        ]
        return "\n".join([f"% {self.caption}", *rules])


def _latex(text: object) -> str:
    """Escape a text for LaTeX. A hyphen before a number becomes a minus sign."""
    escaped = re.sub(r"([%&#_])", r"\\\1", re.sub(r"(?<!\w)-(?=\d)", "$-$", printable(text)))
    return escaped.replace("±", r"$\pm$").replace("'", "$'$")


def count_runs(study: xr.Dataset) -> Counter[str]:
    """Count the runs of a study by the names in `_COUNTED`."""
    return Counter({name: int(np.isin(study["status"], kinds).sum()) for name, kinds in _COUNTED.items()})


def failures(studies: Mapping[str, xr.Dataset], folder: str | None) -> tuple[list[str], Table]:
    """Return sentences that count failed runs, and a table of the runs that means leave out, with the reasons.

    The table has links to files of runs if their `folder` is given.
    """
    sentences = [
        f"Study {name}: {words}."
        for name, study in studies.items()
        if (words := left_out_of_study(study, *_runs_with_loss(study)).words)
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


def _runs_with_loss(study):
    """Return which runs of a study have a loss, and which should have one; nothing if the study has no losses."""
    if "hysteresis_loss" not in study:
        return ()
    return runs_with_loop(study, "hysteresis_loss"), study["surface_energy"] > 0


def _run(run: RunLabels, folder: str | None = None) -> str:
    """Name a run in words, with a link to its file if `folder` is given."""
    words = f"{run.study}: {run.surface}, seed {run.seed}, slope {run.rms_slope:g}, {run.material}, "
    words = printable(words + MODELS[run.model].words)
    return Markup('<a href="{}/{}.nc">{}</a>').format(folder, run.path, words) if folder else words


def _reason(study: xr.Dataset, name: str, run: RunLabels) -> str:
    """Return the text of `failure` or `applicability` of a run."""
    return study[name].isel(run_place(study, run)).item()


def studies_table(studies: Mapping[str, xr.Dataset]) -> Table:
    """Return the table of the studies: numbers of runs, and values of the labels."""
    rows = []
    for name, study in studies.items():
        runs, slopes = count_runs(study), [f"{slope:g}" for slope in slopes_of(study)]
        labels = (study[label].values.tolist() for label in ("surface", "seed", "material"))
        surfaces, seeds, materials = map(list_first, labels)
        models = ", ".join(MODELS[model].words for model in study["model"].values)
        rows.append(
            (name, f"{runs['complete']} of {runs['requested']}", surfaces, seeds, list_first(slopes), materials, models)
        )
    return Table("Studies", ("study", "complete runs", "surfaces", "seeds", "rms slopes", "materials", "models"), rows)


def materials_table(studies: Mapping[str, xr.Dataset]) -> Table:
    """Return the table of all materials; it has flaws and layers only if a material has them."""
    names = ["contact_modulus", "surface_energy", "receding_energy", "interaction_range"]
    for name in ("flaw_radius", "layer_thickness", "layer_poisson_ratio"):
        names += [name] if any(name in study and bool(study[name].any()) for study in studies.values()) else []
    rows = {}
    for study in studies.values():
        for material in study["material"].values.tolist():
            values = study.sel(material=material)
            found = {name: values[name].item() if name in values else np.nan for name in names}
            rows[material] = (material, *(_format(value, quantity(name).unit) for name, value in found.items()))
    return Table("Materials", ("material", *(_words(name) for name in names)), list(rows.values()))


def _words(name: str) -> Markup:
    """Return the name and the symbol of a quantity."""
    words = quantity(name)
    return format_symbols(f"{words.name} {words.text}" if words.symbol else words.name)


def _format(value: float, unit: str) -> str:
    """Format a quantity; a value that is missing or infinite is a dash."""
    if not np.isfinite(value):
        return "–"
    return f"{value:.4g}" if unit == "1" else format_quantity(value, unit)


def surfaces_table(surfaces: Iterable[xr.Dataset]) -> Table:
    """Return a table of the surfaces with the ranges of their statistics over the seeds, as measured for scans."""
    seeds: dict[str, list[xr.Dataset]] = {}
    for surface in surfaces:
        seeds.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    # Powers with which statistics scale with the heights. The table has the reciprocal of the curvature.
    powers = dict.fromkeys(("period", "rolloff_wavelength", "short_wavelength", "hurst", "nayak_parameter"), 0)
    powers |= {"rms_slope": 1, "rms_height": 1, "rms_curvature": 1}
    rows = []
    for name, members in seeds.items():
        cells = []
        for variable, power in powers.items():
            values = [float(each[variable]) * measured_scale(each) ** power for each in members if variable in each]
            unit = quantity(variable).unit
            if variable == "rms_curvature":
                values, unit = [1 / value if value else np.inf for value in values], "m"
            ends = (_format(value, unit) for value in (min(values), max(values))) if values else ("–",)
            cells.append(" to ".join(dict.fromkeys(ends)))
        first = members[0]
        grid, boundary = f"{int(first['grid'])}²", first.attrs.get("boundary", "periodic")
        rows.append((name, list_first(sorted(int(each["seed"]) for each in members)), boundary, grid, *cells))
    caption = (
        "Surfaces, after the preparation of a scan (filter, window). Studies scale the heights to their rms slopes"
    )
    *titles, curvature = map(_words, powers)
    return Table(caption, ("surface", "seeds", "boundary", "grid", *titles, f"1/{curvature}"), rows)


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
