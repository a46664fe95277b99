"""The report of a campaign: one HTML page that needs nothing else, neither network nor other files.

All of it follows from the campaign's data, so the same data give the same bytes. Times and memory are measurements
that differ from one execution to the next: they stand on a page of their own, which this one shows where it lies beside
it. Long tables show their first rows; what is left out is in the data, to which the page links.
"""

from __future__ import annotations

import base64
import importlib.metadata
import itertools
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.analysis.checks import IDENTITY_LIMIT, Check, worst
from icha.analysis.common_loads import at_round_pressures
from icha.analysis.model_error import SUMMARISED
from icha.datasets.campaign import loading_stops, select_run
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.model_paper import MODEL_PAPER
from icha.datasets.variables.campaign import COMPLETE, INCOMPLETE, MISSING, RAGGED
from icha.figures.scale import Scale
from icha.figures.style import COLOURS, quantity, unit_for
from icha.report.inline_svg import Curve, Node, flow_graph, logarithmic_chart
from icha.report.template import scientific, template
from icha.support.atomic_files import whole_file
from icha.support.statistics import ensemble

SOFTWARE = ("icha", "numpy", "scipy", "finufft", "tamaas", "xarray", "netCDF4", "matplotlib", "snakemake")


# A table has so many rows at most, and is folded up if it has more than the second number.
MOST_ROWS = 300
_FOLDED = 30
# More surfaces than this have a scale of colours, and only some are named.
_MOST_SPECTRA = 7
_SHOWS_ON_BLACK = 0.3


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report: its name, caption, the files that hold it, and the studies whose runs it shows."""

    name: str
    caption: str
    png: str | os.PathLike
    pdf: str | os.PathLike
    studies: tuple[str, ...] = ()


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
    files: Mapping[str, str | os.PathLike] = {},
    results: str | os.PathLike | None = None,
    citations: Sequence[str] = (),
) -> None:
    """Write the report.

    Parameters
    ----------
    path : the HTML file; links to other files are relative to its folder.
    campaign : the campaign dataset; its title, summary and licence head the page.
    figures : in order; the PNGs become part of the page, the PDFs are linked. Those of one study stand with it, the
        others before all studies.
    checks : findings of `icha.analysis.checks.check_campaign`.
    comparison : `icha.analysis.common_loads.compare_campaign` of the campaign, if there is one.
    model_error : `icha.analysis.model_error.model_error` of the campaign, if it has boundary elements.
    surfaces : surface files, with or without their heights, for their statistics and power spectra.
    times_path : the page of what the jobs took (`write_times_page`), which is shown where it lies beside this one.
    configuration : text of the configuration as used.
    dataset_path : the campaign dataset's file, to be linked.
    files : further files to be linked, by what they are called.
    results : the folder of the campaign's results, in which the runs and surfaces lie, to be linked.
    citations : further sources to cite, such as those of measurements.
    """
    folder = Path(path).parent
    checks, surfaces = list(checks), list(surfaces)

    def link(target):
        return Path(os.path.relpath(target, folder)).as_posix()

    pictures = [
        {
            "name": figure.name,
            "number": number,
            "caption": figure.caption,
            "data": base64.b64encode(Path(figure.png).read_bytes()).decode("ascii"),
            "pdf": link(figure.pdf),
            "study": study,
        }
        for number, (study, figure) in enumerate(_in_order_of_page(figures, list(campaign.children)), 1)
    ]
    studies = [_study(campaign, name, comparison) for name in campaign.children]
    shown = [_surface(surface) for surface in surfaces[:MOST_ROWS]]
    linked = {name: link(target) for name, target in files.items()}
    page = template("report.html").render(
        title=campaign.attrs.get("title", "Rough contact campaign"),
        summary=campaign.attrs.get("summary", ""),
        attributes=campaign.attrs,
        figures=pictures,
        graph=_provenance(
            studies, surfaces, pictures, model_error, linked, link(dataset_path) if dataset_path else None
        ),
        studies=studies,
        totals={name: sum(study[name] for study in studies) for name in ("asked", "complete", "failed", "missing")},
        entries=[_entry(node.to_dataset()) for node in _entries(model_error)],
        surfaces=shown,
        surface_count=len(surfaces),
        sources=_sources(surfaces),
        spectra=_spectra(surfaces),
        checks=worst(checks),
        check_count=len(checks),
        failed=[check for check in checks if not check.passed],
        times=link(times_path) if times_path is not None else None,
        configuration=configuration,
        dataset=link(dataset_path) if dataset_path is not None else None,
        dataset_name=Path(dataset_path).name if dataset_path is not None else None,
        files=linked,
        results=link(results) if results is not None else None,
        most_rows=MOST_ROWS,
        folded=_FOLDED,
        paper=MODEL_PAPER.line,
        citations=citations,
        references=_references(campaign, model_error),
        software={name: _version(name) for name in SOFTWARE},
    )
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _in_order_of_page(figures, studies):
    """Study (None: of none or of several) and figure, those of none first and then those of every study."""
    places = [None, *studies]
    own = [each.studies[0] if len(each.studies) == 1 and each.studies[0] in studies else None for each in figures]
    return sorted(zip(own, figures, strict=True), key=lambda pair: places.index(pair[0]))


def read_surface_statistics(path: str | os.PathLike) -> xr.Dataset:
    """Read a surface file without its heights."""
    with xr.open_dataset(path, engine="netcdf4", drop_variables=["height", "x", "y"]) as dataset:
        return dataset.load()


def _study(campaign, name, comparison):
    """What the page says about one study."""
    dataset = campaign[name].to_dataset()
    status = dataset["status"].transpose(*LABELS).values
    axes = {label: dataset[label].values.tolist() for label in LABELS}

    def labels_of(kind):
        places = np.argwhere(status == kind).tolist()
        return [RunLabels(name, *(axes[label][i] for label, i in zip(LABELS, at, strict=True))) for at in places]

    complete = labels_of(COMPLETE)
    # Spots and events are many, and not shown.
    small = xr.DataTree.from_dict({f"/{name}": dataset.drop_dims([dim for dim in RAGGED if dim in dataset.dims])})
    runs = [(each, select_run(small, each)) for each in complete[:MOST_ROWS]]
    return {
        "name": name,
        "asked": int(np.isin(status, (COMPLETE, INCOMPLETE, MISSING)).sum()),
        "complete": len(complete),
        "failed": int((status == INCOMPLETE).sum()),
        "missing": int((status == MISSING).sum()),
        "combinations": status.size,
        "failures": [(each, _failure(dataset, each)) for each in labels_of(INCOMPLETE)[:MOST_ROWS]],
        "lacking": labels_of(MISSING)[:MOST_ROWS],
        "axes": axes,
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
            for material in axes["material"][:MOST_ROWS]
        ],
        "runs": [_run(each, run) for each, run in runs],
        "table": _table(runs),
        "means": _means(dataset, complete),
        "loops": _loops(dataset),
        "spread": _spread(comparison[name].to_dataset()) if comparison is not None and name in comparison else None,
    }


def _failure(dataset, labels):
    """Why a run is not complete, as far as it is known."""
    if "failure" not in dataset:
        return ""
    return str(dataset["failure"].sel({label: getattr(labels, label) for label in LABELS}).item())


def _lines(complete):
    """The complete runs of every surface, slope and material."""
    lines: dict[tuple, list[RunLabels]] = {}
    for labels in complete:
        lines.setdefault((labels.surface, labels.rms_slope, labels.material), []).append(labels)
    return lines


def _means(dataset, complete):
    """Rows of means over seeds of A/A0 and mean separation at round pressures, with their 95 % confidence."""
    lines = {line: own for line, own in _lines(complete).items() if len(own) > 1}
    wanted = ["reduced_pressure", "contact_area_fraction", "reduced_separation", "leg", "step_kind", "step_count"]
    wanted += ["mean_gap", "rms_height", "boundary"]
    steps = dataset[wanted]
    rows = []
    for line, own in list(lines.items())[:MOST_ROWS]:
        cells: dict[float, list] = {}
        for labels in own:
            run = steps.sel({label: getattr(labels, label) for label in LABELS})
            for p, *state in at_round_pressures(run.isel(step=slice(0, int(run["step_count"])))):
                cells.setdefault(p, []).append(state)
        over = {p: ensemble(states) for p, states in cells.items() if len(states) == len(own)}
        rows.append((line, len(own), over))
    pressures = sorted({p for *_, over in rows for p in over})
    return {
        "pressures": pressures,
        "count": len(lines),
        "rows": [
            (
                line,
                count,
                [(over[p].mean.tolist(), over[p].confidence.tolist()) if p in over else None for p in pressures],
            )
            for line, count, over in rows
        ],
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


def _loops(dataset):
    """Pull-off and loss of the runs that were pulled off: means over the seeds of every surface, slope and material."""
    if "hysteresis_loss" not in dataset:
        return {"rows": [], "parts": {}, "count": 0}
    status = dataset["status"].transpose(*LABELS)
    whole = (status.values == COMPLETE) & np.isfinite(_of_runs(dataset, "hysteresis_loss"))
    axes = [dataset[label].values.tolist() for label in LABELS]
    lines: dict[tuple, list] = {}
    for surface, seed, slope, material in np.argwhere(whole).tolist():
        line = (axes[0][surface], axes[2][slope], axes[3][material])
        lines.setdefault(line, []).append((surface, seed, slope, material))
    rows = [_loop(dataset, line, members) for line, members in list(lines.items())[:MOST_ROWS]]
    shown = {name for row in rows for name, share in row["shares"].items() if share}
    parts = {name: text for name, text in _LOSS_NAMES.items() if name in shown}
    return {"rows": rows, "parts": parts, "count": len(lines)}


def _of_runs(dataset, name):
    """A quantity of all runs along the labels, also where it depends on fewer of them; steps come last."""
    return dataset[name].broadcast_like(dataset["status"]).transpose(*LABELS, ...).values


def _loop(dataset, line, members):
    places = tuple(np.transpose(members))

    def values(name):
        return _of_runs(dataset, name)[places].astype(float)

    def at_the_end(name):
        return values(name)[np.arange(len(members)), values("step_count").astype(int) - 1]

    # What rounding leaves of a closed loop is no loss.
    rounding = IDENTITY_LIMIT * np.nanmax(np.abs(values("work")), axis=-1)
    loss = values("hysteresis_loss")
    lost = np.abs(loss) > rounding
    adhesive = values("surface_energy")[0] > 0
    parts = {name: values(name).sum() for name in _LOSS_NAMES}
    return {
        "surface": line[0],
        "rms_slope": line[1],
        "material": line[2],
        "seeds": len(members),
        "largest_pressure": _with_confidence(values("largest_reduced_pressure")),
        "largest_area": _with_confidence(values("largest_contact_area_fraction")),
        "pull_off": _with_confidence(values("pull_off_pressure"), "Pa"),
        "at": _with_confidence(values("pull_off_separation") / values("rms_height")) if adhesive else None,
        "over_strength": _with_confidence(values("pull_off_over_strength")) if adhesive else None,
        "over_summits": _with_confidence(values("pull_off_over_summits")) if adhesive else None,
        "detachment": _with_confidence(values("detachment_pressure"), "Pa") if adhesive else None,
        "loss": _with_confidence(np.where(lost, loss, 0.0), "J/m²"),
        "over_energy": _with_confidence(values("hysteresis_loss_over_surface_energy")) if adhesive else None,
        "shares": {name: part / loss.sum() if lost.any() else None for name, part in parts.items()},
        "events": {text: [float(at_the_end(name).mean()) for name in names] for text, names in _EVENT_NAMES.items()},
    }


def _with_confidence(values, unit=""):
    """Mean of values and, of several, its 95 % confidence below it, for the page; with a unit if they have one."""
    over = ensemble(values)
    mean = float(over.mean)
    factor, unit = unit_for(mean, unit) if unit else (1.0, "")
    text = scientific(mean * factor) + (f" {unit}" if unit else "")
    # Loads that are met exactly do not scatter.
    if over.confidence > 1e-6 * abs(mean):
        text += Markup("<br>±&thinsp;") + scientific(float(over.confidence) * factor)
    return text.replace("-", "−")


def _spread(comparison):
    """Largest spread of the area between materials and between slopes, at equal reduced pressure and at equal load.

    None where no two complete runs differ in the material, or slope, alone, or where they share no load.
    """
    complete = comparison["status"] == COMPLETE

    def largest(name, label):
        values = comparison[name].where(complete.sum(label) > 1).values
        return float(np.nanmax(values)) if np.isfinite(values).any() else None

    return {
        f"{short}_spread{suffix}": largest(f"{short}_spread{suffix}", label)
        for label, short in (("material", "material"), ("rms_slope", "slope"))
        for suffix in ("", "_at_load")
    }


def _entries(model_error):
    return model_error.children.values() if model_error is not None else ()


def _entry(errors):
    """What the page says about one entry of the model error: a row for every surface, material and load."""
    several = errors.sizes["seed"] > 1

    def scatter(state, name):
        over = ensemble(state[name].values)
        return float(over.mean), float(over.confidence) if several else None

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
    """Name, seed, parameters and statistics of a surface file."""
    lengths = ("period", "rolloff_wavelength", "short_wavelength", "rms_height")
    numbers = ("hurst", "nayak_parameter", "measured_rms_slope")
    return {
        "name": surface.attrs.get("surface", ""),
        "seed": int(surface["seed"]),
        "grid": int(surface["grid"]),
        "boundary": surface.attrs.get("boundary", "periodic"),
        "rms_slope": float(surface["rms_slope"]),
        "curvature_radius": quantity(1 / float(surface["rms_curvature"]), "m"),
        **{name: float(surface[name]) if name in surface else None for name in numbers},
        **{name: quantity(float(surface[name]), "m") for name in lengths if name in surface},
    }


def _sources(surfaces):
    """File, checksum and preparation of the surfaces that were measured, each once."""
    keys = ("surface", "source_file", "source_sha256", "preparation")
    found = [
        tuple(surface.attrs.get(key, "") for key in keys) for surface in surfaces if "source_file" in surface.attrs
    ]
    return [dict(zip(keys, each, strict=True)) for each in dict.fromkeys(found)]


def _spectra(surfaces):
    """A chart of the power spectra, means over the seeds of every surface; None where no file has one."""
    members: dict[str, list] = {}
    for surface in surfaces:
        if "power_spectrum" in surface:
            members.setdefault(surface.attrs.get("surface", ""), []).append(surface)
    if not members:
        return None
    many = len(members) > _MOST_SPECTRA
    scale = Scale(list(members), darkest=_SHOWS_ON_BLACK) if many else None
    # The last colour is that of the page's text.
    colours = scale.colours if many else [*COLOURS[: _MOST_SPECTRA - 1], "currentColor"]
    named = {0, len(members) // 2, len(members) - 1} if many else set(range(len(members)))
    curves = []
    for k, (name, own) in enumerate(members.items()):
        q = own[0]["psd_wavevector"].values
        same = [each for each in own if each["psd_wavevector"].shape == q.shape]
        power = np.mean([each["power_spectrum"].values for each in same], axis=0)
        shown = (q > 0) & (power > power.max() * _LEAST_POWER)
        curves.append(Curve(name if k in named else "", colours[k], q[shown], power[shown]))
    return logarithmic_chart(
        curves, "wave number q (rad/m)", "power spectrum C(q) (m⁴)", "Power spectra of the surfaces, as stored"
    )


# Below this part of the largest power there is nothing but rounding.
_LEAST_POWER = 1e-16
# More studies than this share one box of the graph.
_MOST_STUDIES = 8


def _provenance(studies, surfaces, figures, model_error, files, dataset):
    """The graph of what was made of what, with how many there are of each."""

    def counted(number, one, many):
        return f"{number} {one if number == 1 else many}"

    begin = {"configuration": Node("Configuration", "as used", files.get("Configuration"))}
    if sources := _sources(surfaces):
        count = len({source["source_sha256"] for source in sources})
        begin["measured"] = Node("Measurements", counted(count, "file", "files"), "#surfaces")
    # A study may have the name of any other box: names of studies hold no blanks.
    middle = {
        f"study {study['name']}": Node(
            _short(study["name"]),
            counted(study["complete"], "run", "runs") + (f", {study['failed']} failed" if study["failed"] else ""),
            f"#study-{study['name']}",
        )
        for study in studies
    }
    if len(middle) > _MOST_STUDIES:
        runs = sum(study["complete"] for study in studies)
        middle = {"studies": Node(counted(len(studies), "study", "studies"), counted(runs, "run", "runs"), "#studies")}
    made: dict[str, Node] = {}
    columns = [
        begin,
        {"surfaces": Node("Surfaces", counted(len(surfaces), "topography", "topographies"), "#surfaces")}
        if surfaces
        else {},
        middle,
        {"dataset": Node("Campaign dataset", "all runs", dataset)},
        made,
        {"report": Node("Report", "this page")},
    ]
    if figures:
        made["figures"] = Node("Figures", counted(len(figures), "figure", "figures"), "#figures")
    if "Comparison" in files:
        made["comparison"] = Node("Comparison", "at common loads", files["Comparison"])
    made["checks"] = Node("Checks", "of the data", "#checks")
    arrows = [(each, "surfaces" if surfaces else study) for each in begin for study in middle]
    arrows += [("surfaces", study) for study in middle] if surfaces else []
    arrows += [(study, "dataset") for study in middle]
    if model_error is not None:
        states = sum(int(node["area_error"].size) for node in model_error.children.values())
        columns[2]["boundary elements"] = Node("Boundary elements", counted(states, "state", "states"), "#error")
        made["error"] = Node("Error of the model", "against them", "#error")
        arrows += [("surfaces", "boundary elements")] if surfaces else []
        arrows += [("boundary elements", "error")]
    arrows += [("dataset", each) for each in made] + [(each, "report") for each in made]
    return flow_graph(columns, list(dict.fromkeys(arrows)), "What was made of what")


def _short(name, most=19):
    return name if len(name) <= most else name[: most - 1] + "…"


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
