"""Sections of the studies: their runs, tables of results, means over the seeds, pull-off and loss."""

from __future__ import annotations

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.checks.findings import IDENTITY_LIMIT
from icha.datasets.campaign import loading_stops, reduced_gap, run_place, runs_of_status, select_run
from icha.datasets.labels import LABELS, RunLabels, labels_at, slopes_of
from icha.datasets.variables.campaign import COMPLETE, COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING, RAGGED
from icha.figures.select import asked_seeds, path_steps
from icha.figures.style import quantity, unit_for
from icha.report.template import MOST_ROWS, scientific
from icha.support.statistics import ENOUGH, ensemble


def study_section(campaign, name, comparison):
    """What the page says about one study."""
    dataset = campaign[name].to_dataset()
    status = dataset["status"].values
    axes = {label: dataset[label].values.tolist() for label in LABELS} | {"rms_slope": slopes_of(dataset)}

    def labels_of(kind):
        return runs_of_status(dataset, name, (kind,))

    complete, failed = labels_of(COMPLETE), [*labels_of(INCOMPLETE), *labels_of(FAILED_CHECKS)]
    # Spots and events are many, and not shown.
    small = xr.DataTree.from_dict({f"/{name}": dataset.drop_dims([dim for dim in RAGGED if dim in dataset.dims])})
    runs = [(each, select_run(small, each)) for each in complete[:MOST_ROWS]]
    return {
        "name": name,
        "asked": int(np.isin(status, (*COMPUTED_RUNS, MISSING)).sum()),
        "complete": len(complete),
        "failed": len(failed),
        "missing": int((status == MISSING).sum()),
        "combinations": status.size,
        "failures": [(each, _reason(dataset, "failure", each)) for each in failed[:MOST_ROWS]],
        "not_applicable": [(each, reason) for each in complete if (reason := _reason(dataset, "applicability", each))],
        "lacking": labels_of(MISSING)[:MOST_ROWS],
        "axes": axes,
        # Their mean gap is not the mean separation, which is that from the half-space far away.
        "free": bool((dataset["boundary"] == "free").any()),
        "materials": [
            {
                "name": material,
                **{
                    key: quantity(float(dataset[key].sel(material=material)), unit)
                    for key, unit in (("contact_modulus", "Pa"), ("surface_energy", "J/m²"), ("interaction_range", "m"))
                    if np.isfinite(dataset[key].sel(material=material))
                },
            }
            for material in axes["material"][:MOST_ROWS]
        ],
        "runs": [_run(each, run) for each, run in runs],
        "table": _table(runs),
        "means": _means(dataset, complete),
        "loops": _loops(name, dataset),
        "spread": _spread(comparison[name].to_dataset()) if comparison is not None and name in comparison else None,
    }


def _reason(dataset, name, labels):
    """Why a run is not complete, or its model not applicable, as far as it is known; "" where neither is so."""
    if name not in dataset:
        return ""
    return str(dataset[name].isel(run_place(dataset, labels)).item())


def _lines(dataset, complete):
    """The complete runs of every surface, slope, material and model, apart where the model is not applicable."""
    lines: dict[tuple, list[RunLabels]] = {}
    for labels in complete:
        applicable = not _reason(dataset, "applicability", labels)
        key = labels.surface, labels.rms_slope, labels.material, labels.model, applicable
        lines.setdefault(key, []).append(labels)
    return lines


def _of_asked(count, dataset, labels):
    """How many seeds a mean has, and of how many asked for if these are more."""
    asked = asked_seeds(dataset, labels)
    return f"{count}" if count == asked else f"{count} of {asked}"


# What the stops of a path may be, and what a table shows at them: of pressure, contact area and mean gap two.
_SHOWN_AT = {
    "reduced_pressure": ("area", "gap"),
    "relative_load": ("area", "gap"),
    "area_fraction": ("pressure", "gap"),
    "mean_separation": ("pressure", "area"),
}
# A table has at most so many stops of a path, evenly chosen among them, as have room on a page.
_MOST_STOPS = 12


def own_stops(run: xr.Dataset) -> dict[tuple[str, float], dict[str, float]]:
    """Reduced pressure, A/A0 and mean gap over h_rms at the stops of a run's loading, by their kind and target."""
    stops = path_steps(run)
    keys = zip(stops["step_kind"].values.tolist(), stops["step_target"].values.tolist(), strict=True)
    values = {
        "pressure": stops["reduced_pressure"].values.tolist(),
        "area": stops["contact_area_fraction"].values.tolist(),
        "gap": reduced_gap(stops).values.tolist(),
    }
    states = (dict(zip(values, state, strict=True)) for state in zip(*values.values(), strict=True))
    return dict(zip(keys, states, strict=True))


def _stops_shown(states):
    """What a table says of its stops: kind, which are shown of how many, and quantities; of the states by run."""
    keys = dict.fromkeys(key for own in states for key in own)
    kind = next((kind for kind, _ in keys), "reduced_pressure")
    targets = sorted(target for each, target in keys if each == kind)
    at = np.unique(np.rint(np.linspace(0, len(targets) - 1, min(len(targets), _MOST_STOPS))).astype(int))
    return {
        "kind": kind,
        "stops": [targets[k] for k in at],
        "stop_count": len(targets),
        "shown": _SHOWN_AT.get(kind, ("area", "gap")),
    }


_FORMS = {"pressure": scientific, "area": scientific, "gap": "{:.3f}".format}


def _means(dataset, complete):
    """Rows of means over seeds at the stops of the path, with how well they are known."""
    lines = {
        line: own for line, own in _lines(dataset, complete).items() if len(own) > 1 or asked_seeds(dataset, own[0]) > 1
    }
    wanted = ["reduced_pressure", "contact_area_fraction", "reduced_separation", "leg", "step_kind", "step_target"]
    wanted += ["step_count", "mean_gap", "rms_height", "boundary"]
    steps = dataset[wanted]
    found = []
    for line, own in list(lines.items())[:MOST_ROWS]:
        runs = [steps.isel(run_place(dataset, labels)) for labels in own]
        states = [own_stops(run.isel(step=slice(0, int(run["step_count"])))) for run in runs]
        found.append((line, _of_asked(len(own), dataset, own[0]), states))
    table = _stops_shown([each for *_, states in found for each in states])

    def cell(states, stop):
        members = [each[table["kind"], stop] for each in states if (table["kind"], stop) in each]
        if len(members) < len(states):
            return None
        return Markup("<br>").join(
            _with_range(np.array([member[name] for member in members]), _FORMS[name]) for name in table["shown"]
        )

    rows = [(line, count, [cell(states, stop) for stop in table["stops"]]) for line, count, states in found]
    return table | {"count": len(lines), "rows": rows}


def _with_range(values, form, between=" "):
    """Mean of values as `form` writes it, and what is known of its accuracy."""
    mean = Markup(form(float(np.mean(values))))
    return mean + (Markup(between) + text if (text := _range(values, form)) else "")


def _range(values, form):
    """What is known of the accuracy of a mean: its 95 % interval, or smallest and largest of fewer than five values.

    The interval of positive values that would reach below zero is that of the logarithm. Values that do not scatter
    have none.
    """
    over = ensemble(values)
    # Loads that are met exactly do not scatter.
    if len(values) < 2 or np.ptp(values) <= 1e-6 * abs(over.mean):
        return ""
    if len(values) < ENOUGH:
        low, high = np.min(values), np.max(values)
    elif np.all(values > 0) and over.confidence >= over.mean:
        low, high = over.band(positive=True)
    else:
        return Markup("±&thinsp;") + form(float(over.confidence))
    return Markup("({} … {})").format(form(float(low)), form(float(high)))


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
        "energy_ratio": float(run["full_contact_energy_ratio"]) if float(run["surface_energy"]) > 0 else None,
        "residual": float(run["residual"].max()) if run.sizes["step"] else None,
        "events": {name: int(run[name].values[k]) for name in _COUNTS for k in loaded},
        "beyond_wu": float(run["outside_wu_fraction"].values[loaded[0]]) if len(loaded) else None,
        "snapshots": snapshots,
    }


def _table(runs):
    """Rows of the states of every run at the stops of the path."""
    states = [(labels, own_stops(run)) for labels, run in runs]
    table = _stops_shown([own for _, own in states])

    def cell(own, stop):
        state = own.get((table["kind"], stop))
        return state and Markup("<br>").join(_FORMS[name](state[name]) for name in table["shown"])

    return table | {"rows": [(labels, [cell(own, stop) for stop in table["stops"]]) for labels, own in states]}


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


def _loops(name, dataset):
    """Pull-off and loss of the runs that were pulled off: means over the seeds of every line of `_lines`."""
    if "hysteresis_loss" not in dataset:
        return {"rows": [], "parts": {}, "count": 0}
    status = dataset["status"].transpose(*LABELS)
    whole = (status.values == COMPLETE) & np.isfinite(_of_runs(dataset, "hysteresis_loss"))
    lines: dict[tuple, list] = {}
    asked: dict[tuple, int] = {}
    for place in np.argwhere(whole).tolist():
        labels = RunLabels(name, *labels_at(dataset, place, LABELS))
        line = tuple((label, getattr(labels, label)) for label in LABELS if label != "seed")
        line += (("applicable", not _reason(dataset, "applicability", labels)),)
        lines.setdefault(line, []).append(tuple(place))
        asked[line] = asked_seeds(dataset, labels)
    rows = [_loop(dataset, line, members, asked[line]) for line, members in list(lines.items())[:MOST_ROWS]]
    shown = {name for row in rows for name, share in row["shares"].items() if share}
    parts = {name: text for name, text in _LOSS_NAMES.items() if name in shown}
    return {"rows": rows, "parts": parts, "count": len(lines)}


def _of_runs(dataset, name):
    """A quantity of all runs along the labels, also where it depends on fewer of them; steps come last."""
    return dataset[name].broadcast_like(dataset["status"]).transpose(*LABELS, ...).values


def _loop(dataset, line, members, asked):
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
        **dict(line),
        "asked": asked,
        "seeds": f"{len(members)}" if len(members) == asked else f"{len(members)} of {asked}",
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
    """Mean of values and what is known of its accuracy below it, for the page; with a unit if they have one."""
    factor, unit = unit_for(float(np.mean(values)), unit) if unit else (1.0, "")
    mean = scientific(float(np.mean(values)) * factor) + (f" {unit}" if unit else "")
    text = _range(values * factor, scientific)
    return (mean + (Markup("<br>") + text if text else "")).replace("-", "−")


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
