"""Sections of the report on the studies: runs, results, means over seeds, pull-off and hysteresis loss."""

from __future__ import annotations

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.analysis.grid_error import describe_grid
from icha.analysis.left_out import AVERAGED_APART, ENDED_EARLY, causes_of_runs, find_left_out, left_out_of_study
from icha.checks.findings import IDENTITY_LIMIT
from icha.datasets.campaign import loading_stops, reduced_gap, run_place, runs_of_status, select_run
from icha.datasets.labels import LABELS, RunLabels, slopes_of
from icha.datasets.variables.campaign import BEYOND_MODEL, COMPUTED_RUNS, FAILED_RUNS, LOADED_RUNS, MISSING, RAGGED
from icha.figures.select import has_shape, path_steps
from icha.references.indenter_runs import BRANCHES, reason_without_fit
from icha.report.template import MOST_ROWS, format_mean, format_range, format_scientific
from icha.support.formatting import choose_unit, format_quantity

# For each kind of target, the quantities that a table shows: two of pressure, contact area and mean gap.
SHOWN_AT = {
    "reduced_pressure": ("area", "gap"),
    "relative_load": ("area", "gap"),
    "area_fraction": ("pressure", "gap"),
    "mean_separation": ("pressure", "area"),
    "pressure": ("area", "gap"),
    "force": ("area", "gap"),
    "indentation": ("pressure", "area"),
    "contact_radius": ("pressure", "gap"),
}
MOST_STOPS = 12  # largest number of targets (columns) in a table; if there are more, 12 are chosen evenly
FORMATS = {"pressure": format_scientific, "area": format_scientific, "gap": "{:.3f}".format}
EVENT_COUNTS = ("spot_count", "jump_in_count", "jump_off_count", "coalescence_count")
STATISTICS = ("asperity_count", "nayak_parameter", "stickiness", "tabor_parameter", "full_contact_energy_ratio")
# Contributions to a loss, and their names on the page.
LOSS_NAMES = {
    "loss_by_jump_in": "jump-in",
    "loss_by_jump_off": "jump-off",
    "loss_by_coalescence": "coalescence",
    "loss_by_load_jump": "jumps at fixed load",
    "loss_unattributed": "without event",
}


def summarise_study(campaign: xr.DataTree, name: str) -> dict:
    """Return the values for the section of one study: numbers of runs, failures, materials, and tables of results."""
    dataset = campaign[name].to_dataset()
    status = dataset["status"].values
    axes = {label: dataset[label].values.tolist() for label in LABELS} | {"rms_slope": slopes_of(dataset)}
    complete, failed, missing = (
        runs_of_status(dataset, name, kinds) for kinds in (LOADED_RUNS, FAILED_RUNS, (MISSING,))
    )
    reasons = [(labels, _reason(dataset, "applicability", labels)) for labels in complete]
    # Spots and events take much memory, and the page does not need these variables.
    small = xr.DataTree.from_dict({f"/{name}": dataset.drop_dims([dim for dim in RAGGED if dim in dataset.dims])})
    runs = [(labels, select_run(small, labels)) for labels in complete[:MOST_ROWS]]
    return {
        "name": name,
        "asked": int(np.isin(status, (*COMPUTED_RUNS, MISSING)).sum()),
        "complete": len(complete),
        "beyond_model": int((status == BEYOND_MODEL).sum()),
        "failed": len(failed),
        "missing": len(missing),
        "combinations": status.size,
        "left_out": left_out_of_study(dataset, of_loss=True).words,
        "failures": [(labels, _reason(dataset, "failure", labels)) for labels in failed[:MOST_ROWS]],
        "not_applicable": [(labels, reason) for labels, reason in reasons if reason],
        "lacking": missing[:MOST_ROWS],
        "axes": axes,
        # For a free square, the mean separation differs from the mean gap (`reduced_gap`).
        "free": bool((dataset["boundary"] == "free").any()),
        "shaped": has_shape(dataset),
        "materials": [_material(dataset.sel(material=material)) for material in axes["material"][:MOST_ROWS]],
        "runs": [_run(labels, run) for labels, run in runs],
        "table": _table(runs),
        "means": _means(dataset, complete),
        "loops": _loops(small, dataset, complete),
        "grid": describe_grid(campaign, [name]),
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
    """Return the statistics of a run; jumps and coalescences are counted up to the end of the first loading."""
    loaded = np.flatnonzero(loading_stops(run).values)[-1:]
    return {
        "labels": labels,
        "steps": run.sizes["step"],
        "adhesive": float(run["surface_energy"]) > 0,
        "residual": float(run["residual"].max()) if run.sizes["step"] else None,
        "events": {name: int(run[name].values[k]) for name in EVENT_COUNTS for k in loaded},
        "beyond_wu": float(run["outside_wu_fraction"].values[loaded[0]]) if len(loaded) else None,
        **{name: float(run[name]) for name in STATISTICS},
    }


# --- tables of states at the targets of the path ---


def collect_states(run: xr.Dataset) -> dict[tuple[str, float], dict[str, float]]:
    """Return reduced pressure, A/A0 and mean gap/h_rms at each target of the loading, by kind and value of target."""
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
    """Choose the targets (at most `MOST_STOPS`) and the two quantities of a table of the given states."""
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
    """Return the table with the states of every run at the targets."""
    states = [(labels, collect_states(run)) for labels, run in runs]
    table = _stops_of([stops for _, stops in states])

    def cell(stops, target):
        state = stops.get((table["kind"], target))
        return state and Markup("<br>").join(FORMATS[name](state[name]) for name in table["shown"])

    return table | {"rows": [(labels, [cell(stops, target) for target in table["stops"]]) for labels, stops in states]}


def _ensembles(dataset: xr.Dataset, runs: list[RunLabels]) -> list[tuple[dict, list[RunLabels]]]:
    """Group runs that differ only in their seed; runs to which the model is not applicable form separate groups.

    For each group, return the first cells of the table row (labels, and seeds that are left out) and the runs of the
    group.
    """
    groups: dict[tuple[RunLabels, bool], list[RunLabels]] = {}
    for run in runs:
        groups.setdefault((run._replace(seed=0), not _reason(dataset, "applicability", run)), []).append(run)
    return [
        ({"labels": labels, "applicable": fit, "left_out": _left_out(dataset, group)}, group)
        for (labels, fit), group in groups.items()
    ]


def _left_out(dataset: xr.Dataset, used: list[RunLabels], *, of_loss: bool = False):
    """Describe the seeds that a mean over the runs `used` leaves out."""
    place = run_place(dataset, used[0])
    del place["seed"]
    at = dataset[["status", *(["applicability"] if "applicability" in dataset else [])]].isel(place)
    causes = []
    for seed, cause in zip(dataset["seed"].values, causes_of_runs(at, of_loss=of_loss).values, strict=True):
        if seed in {labels.seed for labels in used}:
            cause = ""
        elif not cause:
            other = used[0]._replace(seed=int(seed))
            applicable = [not _reason(dataset, "applicability", each) for each in (used[0], other)]
            cause = ENDED_EARLY if applicable[0] == applicable[1] else AVERAGED_APART
        causes.append(cause)
    return find_left_out("seeds", causes)


def _means(dataset: xr.Dataset, complete: list[RunLabels]) -> dict:
    """Return the table of means over seeds at the targets, with the accuracy of each mean."""
    groups = [(row, runs) for row, runs in _ensembles(dataset, complete) if row["left_out"].wanted > 1]
    variables = ["reduced_pressure", "contact_area_fraction", "reduced_separation", "leg", "step_kind", "step_target"]
    steps = dataset[[*variables, "step_count", "mean_gap", "unit_height", "boundary"]]
    members = []
    for row, labels in groups[:MOST_ROWS]:
        runs = [steps.isel(run_place(dataset, each)) for each in labels]
        members.append((row, [collect_states(run.isel(step=slice(0, int(run["step_count"])))) for run in runs]))
    table = _stops_of([stops for _, states in members for stops in states])

    def cell(states, target, has_interval):
        at_stop = [stops[table["kind"], target] for stops in states if (table["kind"], target) in stops]
        if len(at_stop) < len(states):
            return None
        return Markup("<br>").join(
            format_mean(np.array([state[name] for state in at_stop]), FORMATS[name], has_interval=has_interval)
            for name in table["shown"]
        )

    rows = [
        row | {"cells": [cell(states, target, row["left_out"].has_interval) for target in table["stops"]]}
        for row, states in members
    ]
    return table | {"count": len(groups), "rows": rows}


# --- tables of pull-off and loss ---


def _loops(campaign: xr.DataTree, dataset: xr.Dataset, complete: list[RunLabels]) -> dict:
    """Return the tables of pull-off and hysteresis loss of runs with unloading, averaged over seeds."""
    if "pull_off_pressure" not in dataset:
        return {"rows": [], "parts": {}, "count": 0}
    runs = {labels: select_run(campaign, labels) for labels in complete}
    # If a run leaves the range of its model, the path ends before unloading.
    groups = _ensembles(dataset, [labels for labels, run in runs.items() if "pull_off_pressure" in run])
    rows = []
    for row, members in groups[:MOST_ROWS]:
        with_loss = [labels for labels in members if "hysteresis_loss" in runs[labels]]
        of_loss = {"loss_left_out": _left_out(dataset, with_loss, of_loss=True)} if with_loss else {}
        row |= _pull_off([runs[labels] for labels in members], row["left_out"].has_interval)
        rows.append(row | of_loss | _loss([runs[labels] for labels in with_loss], of_loss))
    shown = {name for row in rows for name, share in row["shares"].items() if share}
    parts = {name: text for name, text in LOSS_NAMES.items() if name in shown}
    return {"rows": rows, "parts": parts, "count": len(groups)}


def _pull_off(runs: list[xr.Dataset], has_interval: bool) -> dict:
    """Return the table cells with pull-off, averaged over runs that differ only in their seed."""

    def values(name):
        return np.array([float(run[name]) for run in runs])

    def mean(values, unit=""):
        return _with_unit(values, unit, has_interval=has_interval)

    cells = {
        "largest_pressure": mean(values("largest_reduced_pressure")),
        "largest_area": mean(values("largest_contact_area_fraction")),
        "pull_off": mean(values("pull_off_pressure"), "Pa"),
    }
    if values("surface_energy")[0] > 0:
        cells |= {
            "at": mean(values("pull_off_separation") / values("unit_height")),
            "over_strength": mean(values("pull_off_over_strength")),
            # Boundary elements have no asperities, and one sphere is not a sum of asperities.
            **({} if "force" in runs[0] else {"over_summits": mean(values("pull_off_over_summits"))}),
            "detachment": mean(values("detachment_pressure"), "Pa"),
        }
    units = {"pull_off_force": "N", "pull_off_force_over_theory": ""}
    units |= {f"work_of_adhesion_{branch}": "J/m²" for branch in BRANCHES}
    cells |= {name: mean(values(name), unit) for name, unit in units.items() if all(name in run for run in runs)}
    if all("pull_off_force_over_jkr" in run for run in runs):
        reasons = {branch: list(filter(None, (reason_without_fit(run, branch) for run in runs))) for branch in BRANCHES}
        cells |= {
            f"work_of_adhesion_{branch}": f"no fit of {len(each)} of {len(runs)}: {', '.join(dict.fromkeys(each))}"
            for branch, each in reasons.items()
            if each
        }
    return cells


def _loss(runs: list[xr.Dataset], of_loss: dict) -> dict:
    """Return the table cells with the loss, averaged over runs that differ only in their seed; none without runs."""
    if not runs:
        return {"shares": dict.fromkeys(LOSS_NAMES)}

    def values(name):
        return np.array([float(run[name]) for run in runs])

    # Losses below this bound are rounding errors.
    rounding = IDENTITY_LIMIT * np.array([np.nanmax(np.abs(run["work"].values)) for run in runs])
    loss, has_interval = values("hysteresis_loss"), of_loss["loss_left_out"].has_interval
    lost = np.abs(loss) > rounding
    cells = {"loss": _with_unit(np.where(lost, loss, 0.0), "J/m²", has_interval=has_interval)}
    if values("surface_energy")[0] > 0:
        relative = values("hysteresis_loss_over_surface_energy")
        cells["over_energy"] = _with_unit(relative, has_interval=has_interval)
    shares = {name: values(name).sum() / loss.sum() if lost.any() else None for name in LOSS_NAMES}
    return cells | {"shares": shares}


def _with_unit(values: np.ndarray, unit: str = "", *, has_interval: bool) -> Markup:
    """Format a mean with its unit; a second line contains the accuracy of the mean."""
    factor, unit = choose_unit(float(np.mean(values)), unit) if unit else (1.0, "")
    mean = format_scientific(float(np.mean(values)) * factor) + (f" {unit}" if unit else "")
    text = format_range(values * factor, format_scientific, has_interval=has_interval)
    return (mean + (Markup("<br>") + text if text else "")).replace("-", "−")
