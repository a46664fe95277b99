"""The report of a campaign: one HTML page that needs nothing else, neither network nor other files.

All of it follows from the campaign's data, so the same data give the same bytes. Times and memory are measurements
that differ from one execution to the next: they stand in a table of their own, to which the page links.
"""

from __future__ import annotations

import base64
import csv
import importlib.metadata
import itertools
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import numpy as np
import xarray as xr
from markupsafe import Markup, escape

from icha.aggregation import at_round_pressures
from icha.campaign import RunLabels, loading_stops, run_labels, select_run
from icha.checks import IDENTITY_LIMIT, Check, worst
from icha.figures.style import quantity, unit_for
from icha.files import whole_file
from icha.model_error import SUMMARISED

PAPER = (
    "G. Violano and L. Afferrante, Modeling the adhesive contact of rough soft media with an advanced asperity model"
)
SOFTWARE = ("icha", "numpy", "scipy", "finufft", "tamaas", "xarray", "netCDF4", "matplotlib", "snakemake")


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report: its name, caption, and the files that hold it."""

    name: str
    caption: str
    png: str | os.PathLike
    pdf: str | os.PathLike


@dataclass(frozen=True)
class Benchmark:
    """What one job took: wall time in s and peak memory in MB (none where it ended before it was measured)."""

    job: str
    seconds: float
    megabytes: float | None


def write_report(
    path: str | os.PathLike,
    *,
    campaign: xr.DataTree,
    figures: Sequence[ReportFigure],
    checks: Iterable[Check],
    comparison: xr.DataTree | None = None,
    model_error: xr.DataTree | None = None,
    surfaces: Iterable[xr.Dataset] = (),
    times_path: str | os.PathLike | None = None,
    configuration: str = "",
    dataset_path: str | os.PathLike | None = None,
    citations: Sequence[str] = (),
) -> None:
    """Write the report.

    Parameters
    ----------
    path : the HTML file; links to other files are relative to its folder.
    campaign : the campaign dataset; its title, summary and licence head the page.
    figures : in order; the PNGs become part of the page, the PDFs are linked.
    checks : findings of `icha.checks.check_campaign`.
    comparison : `icha.aggregation.compare_campaign` of the campaign, if there is one.
    model_error : `icha.model_error.model_error` of the campaign, if it has boundary elements.
    surfaces : surface files, for the parameters of their spectra.
    times_path : the table of what the jobs took, to be named.
    configuration : text of the configuration as used.
    dataset_path : the campaign dataset's file, to be linked.
    citations : further sources to cite, such as those of measurements.
    """
    folder = Path(path).parent
    checks = list(checks)

    def link(target):
        return Path(os.path.relpath(target, folder)).as_posix()

    pictures = [
        {
            "name": figure.name,
            "caption": figure.caption,
            "data": base64.b64encode(Path(figure.png).read_bytes()).decode("ascii"),
            "pdf": link(figure.pdf),
        }
        for figure in figures
    ]
    page = _template().render(
        title=campaign.attrs.get("title", "Rough contact campaign"),
        summary=campaign.attrs.get("summary", ""),
        attributes=campaign.attrs,
        figures=pictures,
        studies=[_study(campaign, name, comparison) for name in campaign.children],
        entries=[_entry(node.to_dataset()) for node in _entries(model_error)],
        surfaces=[_surface(surface) for surface in surfaces],
        checks=worst(checks),
        check_count=len(checks),
        failed=[check for check in checks if not check.passed],
        times=link(times_path) if times_path is not None else None,
        configuration=configuration,
        dataset=link(dataset_path) if dataset_path is not None else None,
        dataset_name=Path(dataset_path).name if dataset_path is not None else None,
        paper=PAPER,
        citations=citations,
        references=_references(campaign, model_error),
        software={name: _version(name) for name in SOFTWARE},
    )
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def read_benchmarks(files: Mapping[str, str | os.PathLike]) -> list[Benchmark]:
    """Read Snakemake's benchmark files, `.jsonl` or tab-separated, by name of their job; repeats add up.

    Files that are not there (a job that was not run again after an update, say) are left out.
    """
    found = []
    for job, path in files.items():
        path = Path(path)
        if not path.exists():
            continue
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".jsonl":
            rows = [json.loads(line) for line in text.splitlines() if line.strip()]
        else:
            rows = list(csv.DictReader(text.splitlines(), delimiter="\t"))
        seconds = sum(float(row["s"]) for row in rows)
        memory = [float(row["max_rss"]) for row in rows if _is_number(row.get("max_rss"))]
        found.append(Benchmark(job, seconds, max(memory, default=None)))
    return found


def _is_number(text):
    try:
        return np.isfinite(float(text))
    except (TypeError, ValueError):
        return False


def _study(campaign, name, comparison):
    """What the page says about one study."""
    dataset = campaign[name].to_dataset()
    labels = [each for each in run_labels(campaign) if each.study == name]
    runs = [(each, select_run(campaign, each)) for each in labels]
    return {
        "name": name,
        "count": int(dataset["status"].size),
        "present": len(runs),
        "axes": {label: dataset[label].values.tolist() for label in ("surface", "seed", "rms_slope", "material")},
        "materials": [
            {
                "name": material,
                **{
                    key: quantity(float(dataset[key].sel(material=material)), unit)
                    for key, unit in (
                        ("contact_modulus", "Pa"),
                        ("surface_energy", "J/m²"),
                        ("interaction_range", "m"),
                    )
                    if np.isfinite(dataset[key].sel(material=material))
                },
            }
            for material in dataset["material"].values.tolist()
        ],
        "runs": [_run(each, run) for each, run in runs],
        "table": _table(runs),
        "loops": _loops(runs),
        "spread": _spread(comparison[name].to_dataset()) if comparison is not None and name in comparison else None,
    }


# What is counted of every run.
_COUNTS = ("spot_count", "jump_in_count", "jump_off_count", "coalescence_count")


def _run(labels: RunLabels, run):
    # After complete separation nothing is left to be counted: contact is shown at the end of the first loading.
    loaded = np.flatnonzero(loading_stops(run).values)[-1:]
    snapshots = [
        {
            "kind": str(run["snapshot_kind"].values[k]),
            "target": float(run["snapshot_target"].values[k]),
            "area": float(run["contact_area_fraction"].values[int(run["snapshot_step"].values[k])]),
            "spots": int(run["spot_count"].values[int(run["snapshot_step"].values[k])]),
            "overlap": float(run["overlap_fraction"].values[k]),
        }
        for k in range(run.sizes["snapshot"])
    ]
    return {
        "labels": labels,
        "steps": run.sizes["step"],
        "tabor": float(run["tabor_parameter"]) if float(run["surface_energy"]) > 0 else None,
        "asperities": int(run["asperity_count"]),
        "rms_height": quantity(float(run["rms_height"]), "m"),
        "period": quantity(float(run["period"]), "m"),
        "grid": int(run["grid"]),
        "nayak_parameter": float(run["nayak_parameter"]),
        "stickiness": float(run["stickiness"]),
        "residual": float(run["residual"].max()) if run.sizes["step"] else None,
        "events": {name: int(run[name].values[k]) for name in _COUNTS for k in loaded},
        "beyond_wu": float(run["outside_wu_fraction"].values[loaded[0]]) if len(loaded) else None,
        "snapshots": snapshots,
    }


def _table(runs):
    """Rows of A/A0 and mean separation at round pressures: one of cells for each run."""
    rows = [(labels, {p: (area, gap) for p, area, gap in at_round_pressures(run)}) for labels, run in runs]
    pressures = sorted({p for _, cells in rows for p in cells})
    return {"pressures": pressures, "rows": [(labels, [cells.get(p) for p in pressures]) for labels, cells in rows]}


# What a loss consists of, as the page calls it.
_LOSS_NAMES = {
    "loss_by_jump_in": "jumping in",
    "loss_by_jump_off": "jumping off",
    "loss_by_coalescence": "unions",
    "loss_by_load_jump": "at fixed load",
    "loss_unattributed": "no event",
}
_EVENT_NAMES = {
    "Contacts formed, broken": ("jump_in_count", "jump_off_count"),
    "Unions, undone": ("coalescence_count", "split_count"),
}


def _loops(runs):
    """Pull-off and loss of the runs that were pulled off: means over the seeds of every surface, slope and material."""
    lines: dict[tuple, list] = {}
    for labels, run in runs:
        if "hysteresis_loss" in run:
            lines.setdefault((labels.surface, labels.rms_slope, labels.material), []).append(run)
    rows = [_loop(*line, members) for line, members in lines.items()]
    shown = {name for row in rows for name, share in row["shares"].items() if share}
    return {"rows": rows, "parts": {name: text for name, text in _LOSS_NAMES.items() if name in shown}}


def _loop(surface, rms_slope, material, members):
    def values(name):
        return np.array([float(run[name]) for run in members])

    # What rounding leaves of a closed loop is no loss.
    rounding = IDENTITY_LIMIT * np.array([float(np.abs(run["work"]).max()) for run in members])
    loss = values("hysteresis_loss")
    lost = np.abs(loss) > rounding
    adhesive = float(members[0]["surface_energy"]) > 0
    parts = {name: values(name).sum() for name in _LOSS_NAMES}
    return {
        "surface": surface,
        "rms_slope": rms_slope,
        "material": material,
        "seeds": len(members),
        "largest_pressure": _with_scatter(values("largest_reduced_pressure")),
        "largest_area": _with_scatter(values("largest_contact_area_fraction")),
        "pull_off": _with_scatter(values("pull_off_pressure"), "Pa"),
        "at": _with_scatter(values("pull_off_separation") / values("rms_height")) if adhesive else None,
        "over_strength": _with_scatter(values("pull_off_over_strength")) if adhesive else None,
        "over_summits": _with_scatter(values("pull_off_over_summits")) if adhesive else None,
        "detachment": _with_scatter(values("detachment_pressure"), "Pa") if adhesive else None,
        "loss": _with_scatter(np.where(lost, loss, 0.0), "J/m²"),
        "over_energy": _with_scatter(values("hysteresis_loss_over_surface_energy")) if adhesive else None,
        "shares": {name: part / loss.sum() if lost.any() else None for name, part in parts.items()},
        "events": {
            text: [float(np.mean([run[name].values[-1] for run in members])) for name in names]
            for text, names in _EVENT_NAMES.items()
        },
    }


def _with_scatter(values, unit=""):
    """Mean of values and, of several, their standard deviation below it, for the page; with a unit if they have one."""
    mean, deviation = float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    factor, unit = unit_for(mean, unit) if unit else (1.0, "")
    text = _scientific(mean * factor) + (f" {unit}" if unit else "")
    # Loads that are met exactly do not scatter.
    if deviation > 1e-6 * abs(mean):
        text += Markup("<br>±&thinsp;") + _scientific(deviation * factor)
    return text.replace("-", "−")


def _spread(comparison):
    """Largest spread of the area between materials and between slopes, at equal reduced pressure and at equal load."""

    def largest(name):
        values = comparison[name].values
        return float(np.nanmax(values)) if np.isfinite(values).any() else None

    names = ("material_spread", "slope_spread", "material_spread_at_load", "slope_spread_at_load")
    return {name: largest(name) for name in names}


def _entries(model_error):
    return model_error.children.values() if model_error is not None else ()


def _entry(errors):
    """What the page says about one entry of the model error: a row for every surface, material and load."""
    several = errors.sizes["seed"] > 1

    def scatter(state, name):
        mean = float(state[f"{name}_mean"])
        return mean, float(state[f"{name}_deviation"]) if several else None

    rows = []
    for surface, slope, material in itertools.product(
        *(errors[label].values.tolist() for label in ("surface", "rms_slope", "material"))
    ):
        for p in errors["reduced_pressure"].values.tolist():
            state = errors.sel(surface=surface, rms_slope=slope, material=material, reduced_pressure=p)
            rows.append(
                {
                    "surface": surface,
                    "rms_slope": slope,
                    "material": material,
                    "reduced_pressure": p,
                    "area": float(state["contact_area_fraction"].mean()),
                    "true_area": float(state["contact_area_fraction_boundary_elements"].mean()),
                    **{name: scatter(state, name) for name in SUMMARISED},
                }
            )

    def spread(name):
        values = errors[name].values
        return {"median": float(np.median(values)), "least": float(values.min()), "most": float(values.max())}

    tabor = errors["tabor_parameter"].values
    return {
        "name": errors.attrs["entry"],
        "study": errors.attrs["study"],
        "axes": {label: errors[label].values.tolist() for label in ("rms_slope", "material", "seed")},
        "states": int(errors["area_error"].size),
        "grids": sorted(set(errors["solution_grid"].values.ravel().tolist())),
        "adhesive": bool((errors["surface_energy"] > 0).any()),
        "tabor": list(dict.fromkeys(f"{mu:.2g}" for mu in (tabor.min(), tabor.max()))),
        "load_error": float(np.abs(errors["load_error"]).max()),
        "residual": float(errors["residual"].max()),
        "rows": rows,
        **{name: spread(name) for name in (*SUMMARISED, "perimeter_correction")},
    }


def _surface(surface):
    """Name, seed and parameters of a surface file."""
    lengths = ("period", "rolloff_wavelength", "short_wavelength", "rms_height")
    return {
        "name": surface.attrs.get("surface", ""),
        "seed": int(surface["seed"]),
        "grid": int(surface["grid"]),
        "hurst": float(surface["hurst"]) if "hurst" in surface else None,
        "rms_slope": float(surface["rms_slope"]),
        "curvature_radius": quantity(1 / float(surface["rms_curvature"]), "m"),
        **{name: quantity(float(surface[name]), "m") for name in lengths if name in surface},
    }


def _references(campaign, model_error):
    """Sources that the studies' datasets and their boundary elements name, each once."""
    nodes = [*campaign.children.values(), *_entries(model_error)]
    found = (node.attrs.get("references", "") for node in nodes)
    return list(dict.fromkeys(part.strip() for text in found for part in text.split(";") if part.strip()))


def _version(name):
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


# Symbols as they stand in captions and attributes, and how a page sets them.
_SYMBOLS = (
    (re.compile(r"h(?:&#39;|')_?rms"), "<i>h</i>′<sub>rms</sub>"),
    (re.compile(r"\bh_rms"), "<i>h</i><sub>rms</sub>"),
    (re.compile(r"\bE\*"), "<i>E</i><sup>∗</sup>"),
    (re.compile(r"\bA0\b"), "<i>A</i><sub>0</sub>"),
)


def _symbols(text: str) -> Markup:
    """Set the symbols of plain text: E*, A0, h'rms."""
    result = str(escape(text))
    for pattern, replacement in _SYMBOLS:
        result = pattern.sub(replacement, result)
    return Markup(result)


def _scientific(value: float | None) -> Markup:
    """A number with three digits, in powers of ten where it is small or large."""
    if value is None:
        return Markup("–")
    if value == 0:
        return Markup("0")
    exponent = int(np.floor(np.log10(abs(value))))
    if -3 <= exponent < 4:
        return Markup(escape(f"{value:.{max(0, 2 - exponent)}f}" if exponent < 3 else f"{value:.0f}"))
    return Markup(f"{value / 10.0**exponent:.2f}&thinsp;×&thinsp;10<sup>{str(exponent).replace('-', '−')}</sup>")


def _per_cent(value: float, *, signed: bool = True) -> str:
    """A part in per cent, to a tenth, with a true minus sign."""
    text = f"{100 * value:+.1f}" if signed else f"{100 * value:.1f}"
    return text.replace("+0.0", "0.0").replace("-0.0", "0.0").replace("-", "−")


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("icha", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"symbols": _symbols, "scientific": _scientific, "per_cent": _per_cent}
    return environment.get_template("report.html")
