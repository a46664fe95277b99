"""Sections of the studies: runs, results, means over the seeds, pull-off and loss."""

from __future__ import annotations

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.checks.findings import IDENTITY_LIMIT
from icha.datasets.campaign import loading_stops, reduced_gap, run_place, runs_of_status, select_run
from icha.datasets.labels import LABELS, RunLabels, labels_at, slopes_of
from icha.datasets.variables.campaign import (
    BEYOND_MODEL,
    COMPLETE,
    COMPUTED_RUNS,
    FAILED_CHECKS,
    INCOMPLETE,
    LOADED_RUNS,
    MISSING,
    RAGGED,
)
from icha.figures.select import asked_seeds, path_steps
from icha.report.template import MOST_ROWS, format_scientific
from icha.support.formatting import choose_unit, format_quantity
from icha.support.statistics import ENOUGH, ensemble

# Quantities in a table by the kind of its stops: two of pressure, contact area and mean gap.
SHOWN_AT = {
    "reduced_pressure": ("area", "gap"),
    "relative_load": ("area", "gap"),
    "area_fraction": ("pressure", "gap"),
    "mean_separation": ("pressure", "area"),
}
MOST_STOPS = 12  # columns of a table, evenly chosen
FORMATS = {"pressure": format_scientific, "area": format_scientific, "gap": "{:.3f}".format}
EVENT_COUNTS = ("spot_count", "jump_in_count", "jump_off_count", "coalescence_count")
# Contributions to a loss, and their names on the page.
LOSS_NAMES = {
    "loss_by_jump_in": "jumping in",
    "loss_by_jump_off": "jumping off",
    "loss_by_coalescence": "unions",
    "loss_by_load_jump": "at fixed load",
    "loss_unattributed": "no event",
}
EVENT_NAMES = {
    "Contacts formed, broken": ("jump_in_count", "jump_off_count"),
    "Unions, undone": ("coalescence_count", "split_count"),
}


def summarise_study(campaign: xr.DataTree, name: str, comparison: xr.DataTree | None) -> dict:
    """Return what the page prints about one study."""
    dataset = campaign[name].to_dataset()
    status = dataset["status"].values
    axes = {label: dataset[label].values.tolist() for label in LABELS} | {"rms_slope": slopes_of(dataset)}
    complete, incomplete, failed_checks, missing = (
        runs_of_status(dataset, name, kinds) for kinds in (LOADED_RUNS, (INCOMPLETE,), (FAILED_CHECKS,), (MISSING,))
    )
    failed = [*incomplete, *failed_checks]
    reasons = [(labels, _reason(dataset, "applicability", labels)) for labels in complete]
    # Spots and events are many, and the page does not need them.
    small = xr.DataTree.from_dict({f"/{name}": dataset.drop_dims([dim for dim in RAGGED if dim in dataset.dims])})
    runs = [(labels, select_run(small, labels)) for labels in complete[:MOST_ROWS]]
    has_comparison = comparison is not None and name in comparison
    return {
        "name": name,
        "asked": int(np.isin(status, (*COMPUTED_RUNS, MISSING)).sum()),
        "complete": len(complete),
        "beyond_model": int((status == BEYOND_MODEL).sum()),
        "failed": len(failed),
        "missing": len(missing),
        "combinations": status.size,
        "failures": [(labels, _reason(dataset, "failure", labels)) for labels in failed[:MOST_ROWS]],
        "not_applicable": [(labels, reason) for labels, reason in reasons if reason],
        "lacking": missing[:MOST_ROWS],
        "axes": axes,
        # Above a free square, the mean separation is that from the half-space far away, not the mean gap.
        "free": bool((dataset["boundary"] == "free").any()),
        "materials": [_material(dataset.sel(material=material)) for material in axes["material"][:MOST_ROWS]],
        "runs": [_run(labels, run) for labels, run in runs],
        "table": _table(runs),
        "means": _means(dataset, complete),
        "loops": _loops(name, dataset),
        "spread": _spread(comparison[name].to_dataset()) if has_comparison else None,
    }


def _reason(dataset: xr.Dataset, name: str, labels: RunLabels) -> str:
    """Return the text of `failure` or `applicability` of a run; empty text if the dataset has no such variable."""
    return str(dataset[name].isel(run_place(dataset, labels)).item()) if name in dataset else ""


def _material(dataset: xr.Dataset) -> dict[str, str]:
    units = {"contact_modulus": "Pa", "surface_energy": "J/m²", "interaction_range": "m"}
    values = {
        key: format_quantity(float(dataset[key]), unit) for key, unit in units.items() if np.isfinite(dataset[key])
    }
    return {"name": dataset["material"].item()} | values


def _run(labels: RunLabels, run: xr.Dataset) -> dict:
    """Return the statistics of a run: events up to the end of its first loading, since none remain after separation."""
    loaded = np.flatnonzero(loading_stops(run).values)[-1:]
    adhesive = float(run["surface_energy"]) > 0
    snapshots = []
    for k in range(run.sizes["snapshot"]):
        step = int(run["snapshot_step"].values[k])
        snapshots.append(
            {
                "kind": str(run["snapshot_kind"].values[k]),
                "target": float(run["snapshot_target"].values[k]),
                "area": float(run["contact_area_fraction"].values[step]),
                "spots": int(run["spot_count"].values[step]),
                "overlap": float(run["overlap_fraction"].values[k]),
            }
        )
    return {
        "labels": labels,
        "steps": run.sizes["step"],
        "tabor": float(run["tabor_parameter"]) if adhesive else None,
        "asperities": int(run["asperity_count"]),
        "nayak_parameter": float(run["nayak_parameter"]),
        "stickiness": float(run["stickiness"]),
        "energy_ratio": float(run["full_contact_energy_ratio"]) if adhesive else None,
        "residual": float(run["residual"].max()) if run.sizes["step"] else None,
        "events": {name: int(run[name].values[k]) for name in EVENT_COUNTS for k in loaded},
        "beyond_wu": float(run["outside_wu_fraction"].values[loaded[0]]) if len(loaded) else None,
        "snapshots": snapshots,
    }


# --- tables of states at the stops of the path ---


def collect_states(run: xr.Dataset) -> dict[tuple[str, float], dict[str, float]]:
    """Return reduced pressure, A/A0 and mean gap over h_rms at the stops of a loading, by kind and target."""
    stops = path_steps(run)
    keys = zip(stops["step_kind"].values.tolist(), stops["step_target"].values.tolist(), strict=True)
    values = {
        "pressure": stops["reduced_pressure"].values.tolist(),
        "area": stops["contact_area_fraction"].values.tolist(),
        "gap": reduced_gap(stops).values.tolist(),
    }
    states = (dict(zip(values, state, strict=True)) for state in zip(*values.values(), strict=True))
    return dict(zip(keys, states, strict=True))


def _stops_of(states) -> dict:
    """Return the targets and the quantities that a table shows, from the states of its runs."""
    keys = dict.fromkeys(key for stops in states for key in stops)
    kind = next((kind for kind, _ in keys), "reduced_pressure")
    targets = sorted(target for each, target in keys if each == kind)
    chosen = np.unique(np.rint(np.linspace(0, len(targets) - 1, min(len(targets), MOST_STOPS))).astype(int))
    return {
        "kind": kind,
        "stops": [targets[k] for k in chosen],
        "stop_count": len(targets),
        "shown": SHOWN_AT.get(kind, ("area", "gap")),
    }


def _table(runs) -> dict:
    """Return rows with the states of every run."""
    states = [(labels, collect_states(run)) for labels, run in runs]
    table = _stops_of([stops for _, stops in states])

    def cell(stops, target):
        state = stops.get((table["kind"], target))
        return state and Markup("<br>").join(FORMATS[name](state[name]) for name in table["shown"])

    return table | {"rows": [(labels, [cell(stops, target) for target in table["stops"]]) for labels, stops in states]}


def _means(dataset: xr.Dataset, complete: list[RunLabels]) -> dict:
    """Return rows with means over seeds and their accuracy; runs to which the model is not applicable are separate."""
    lines: dict[tuple, list[RunLabels]] = {}
    for labels in complete:
        applicable = not _reason(dataset, "applicability", labels)
        line = labels.surface, labels.rms_slope, labels.material, labels.model, applicable
        lines.setdefault(line, []).append(labels)
    lines = {line: runs for line, runs in lines.items() if len(runs) > 1 or asked_seeds(dataset, runs[0]) > 1}
    variables = ["reduced_pressure", "contact_area_fraction", "reduced_separation", "leg", "step_kind", "step_target"]
    steps = dataset[[*variables, "step_count", "mean_gap", "rms_height", "boundary"]]
    members = []
    for line, labels in list(lines.items())[:MOST_ROWS]:
        runs = [steps.isel(run_place(dataset, each)) for each in labels]
        states = [collect_states(run.isel(step=slice(0, int(run["step_count"])))) for run in runs]
        members.append((line, _seed_count(len(labels), asked_seeds(dataset, labels[0])), states))
    table = _stops_of([stops for *_, states in members for stops in states])

    def cell(states, target):
        at_stop = [stops[table["kind"], target] for stops in states if (table["kind"], target) in stops]
        if len(at_stop) < len(states):
            return None
        return Markup("<br>").join(
            _mean(np.array([state[name] for state in at_stop]), FORMATS[name]) for name in table["shown"]
        )

    rows = [(line, count, [cell(states, target) for target in table["stops"]]) for line, count, states in members]
    return table | {"count": len(lines), "rows": rows}


def _seed_count(count: int, asked: int) -> str:
    """Return the number of seeds of a mean, and that of the requested ones if these are more."""
    return f"{count}" if count == asked else f"{count} of {asked}"


def _mean(values: np.ndarray, form) -> Markup:
    """Format a mean and its accuracy."""
    mean = Markup(form(float(np.mean(values))))
    return mean + (Markup(" ") + text if (text := _range(values, form)) else "")


def _range(values: np.ndarray, form) -> Markup | str:
    """Format the 95 % interval of a mean, or the extremes of fewer than five values; nothing without scatter.

    If the interval of positive values would reach below zero, the interval of the logarithm is used.
    """
    over = ensemble(values)
    # Loads are met exactly, but for rounding errors.
    if len(values) < 2 or np.ptp(values) <= 1e-6 * abs(over.mean):
        return ""
    if len(values) < ENOUGH:
        low, high = np.min(values), np.max(values)
    elif np.all(values > 0) and over.confidence >= over.mean:
        low, high = over.band(positive=True)
    else:
        return Markup("±&thinsp;") + form(float(over.confidence))
    return Markup("({} … {})").format(form(float(low)), form(float(high)))


# --- tables of pull-off and loss ---


def _loops(name: str, dataset: xr.Dataset) -> dict:
    """Return pull-off and loss of the unloaded runs, averaged over seeds."""
    if "hysteresis_loss" not in dataset:
        return {"rows": [], "parts": {}, "count": 0}
    status = dataset["status"].transpose(*LABELS)
    whole = (status.values == COMPLETE) & np.isfinite(_along_labels(dataset, "hysteresis_loss"))
    lines: dict[tuple, list] = {}
    seeds: dict[tuple, int] = {}
    for place in np.argwhere(whole).tolist():
        labels = RunLabels(name, *labels_at(dataset, place, LABELS))
        line = tuple((label, getattr(labels, label)) for label in LABELS if label != "seed")
        line += (("applicable", not _reason(dataset, "applicability", labels)),)
        lines.setdefault(line, []).append(tuple(place))
        seeds[line] = asked_seeds(dataset, labels)
    rows = [dict(line) | _loop(dataset, places, seeds[line]) for line, places in list(lines.items())[:MOST_ROWS]]
    shown = {name for row in rows for name, share in row["shares"].items() if share}
    parts = {name: text for name, text in LOSS_NAMES.items() if name in shown}
    return {"rows": rows, "parts": parts, "count": len(lines)}


def _along_labels(dataset: xr.Dataset, name: str) -> np.ndarray:
    """Return a variable, repeated along the labels on which it does not depend; the last dimension is the step."""
    return dataset[name].broadcast_like(dataset["status"]).transpose(*LABELS, ...).values


def _loop(dataset: xr.Dataset, members: list[tuple], asked: int) -> dict:
    """Return the row of runs that differ in their seed only; `members` are their indices along the labels."""
    places = tuple(np.transpose(members))

    def values(name):
        return _along_labels(dataset, name)[places].astype(float)

    def mean_at_the_end(name):
        return float(values(name)[np.arange(len(members)), values("step_count").astype(int) - 1].mean())

    # A smaller loss of a closed loop is a rounding error.
    rounding = IDENTITY_LIMIT * np.nanmax(np.abs(values("work")), axis=-1)
    loss = values("hysteresis_loss")
    lost = np.abs(loss) > rounding
    adhesive = values("surface_energy")[0] > 0
    cells = {
        "largest_pressure": _with_unit(values("largest_reduced_pressure")),
        "largest_area": _with_unit(values("largest_contact_area_fraction")),
        "pull_off": _with_unit(values("pull_off_pressure"), "Pa"),
        "loss": _with_unit(np.where(lost, loss, 0.0), "J/m²"),
    }
    adhesive_cells = {
        "at": (values("pull_off_separation") / values("rms_height"), ""),
        "over_strength": (values("pull_off_over_strength"), ""),
        "over_summits": (values("pull_off_over_summits"), ""),
        "detachment": (values("detachment_pressure"), "Pa"),
        "over_energy": (values("hysteresis_loss_over_surface_energy"), ""),
    }
    cells |= {name: _with_unit(*cell) if adhesive else None for name, cell in adhesive_cells.items()}
    return cells | {
        "asked": asked,
        "seeds": _seed_count(len(members), asked),
        "shares": {name: values(name).sum() / loss.sum() if lost.any() else None for name in LOSS_NAMES},
        "events": {text: [mean_at_the_end(name) for name in names] for text, names in EVENT_NAMES.items()},
    }


def _with_unit(values: np.ndarray, unit: str = "") -> Markup:
    """Format a mean with its unit, and its accuracy below it."""
    factor, unit = choose_unit(float(np.mean(values)), unit) if unit else (1.0, "")
    mean = format_scientific(float(np.mean(values)) * factor) + (f" {unit}" if unit else "")
    text = _range(values * factor, format_scientific)
    return (mean + (Markup("<br>") + text if text else "")).replace("-", "−")


def _spread(comparison: xr.Dataset) -> dict[str, float | None]:
    """Return the largest differences of the area between materials and slopes, at equal pressure and at equal load.

    None if no two complete runs differ in this label only, or share a load.
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
