"""Sections of the studies: their runs, tables of results, means over the seeds, pull-off and loss."""

from __future__ import annotations

import numpy as np
import xarray as xr
from markupsafe import Markup

from icha.analysis.common_loads import at_round_pressures
from icha.checks.findings import IDENTITY_LIMIT
from icha.datasets.campaign import loading_stops, run_place, runs_of_status, select_run
from icha.datasets.labels import LABELS, RunLabels
from icha.datasets.places import labels_at, slopes_of
from icha.datasets.variables.campaign import COMPLETE, COMPUTED_RUNS, FAILED_CHECKS, INCOMPLETE, MISSING, RAGGED
from icha.figures.style import quantity, unit_for
from icha.report.template import MOST_ROWS, scientific
from icha.support.statistics import ensemble


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
        "failures": [(each, _failure(dataset, each)) for each in failed[:MOST_ROWS]],
        "lacking": labels_of(MISSING)[:MOST_ROWS],
        "axes": axes,
        # Their mean gap is not the mean separation, which is that from the half-space far away.
        "free": bool((dataset["boundary"] == "free").any()),
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
    return str(dataset["failure"].isel(run_place(dataset, labels)).item())


def _lines(complete):
    """The complete runs of every surface, slope, material and model."""
    lines: dict[tuple, list[RunLabels]] = {}
    for labels in complete:
        lines.setdefault((labels.surface, labels.rms_slope, labels.material, labels.model), []).append(labels)
    return lines


def _means(dataset, complete):
    """Rows of means over seeds of A/A0 and mean gap at round pressures, with their 95 % confidence."""
    lines = {line: own for line, own in _lines(complete).items() if len(own) > 1}
    wanted = ["reduced_pressure", "contact_area_fraction", "reduced_separation", "leg", "step_kind", "step_count"]
    wanted += ["mean_gap", "rms_height", "boundary"]
    steps = dataset[wanted]
    rows = []
    for line, own in list(lines.items())[:MOST_ROWS]:
        cells: dict[float, list] = {}
        for labels in own:
            run = steps.isel(run_place(dataset, labels))
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
        "energy_ratio": float(run["full_contact_energy_ratio"]) if float(run["surface_energy"]) > 0 else None,
        "residual": float(run["residual"].max()) if run.sizes["step"] else None,
        "events": {name: int(run[name].values[k]) for name in _COUNTS for k in loaded},
        "beyond_wu": float(run["outside_wu_fraction"].values[loaded[0]]) if len(loaded) else None,
        "snapshots": snapshots,
    }


def _table(runs):
    """Rows of A/A0 and mean gap at round pressures: one of cells for each run."""
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
    """Pull-off and loss of the runs that were pulled off: means over the seeds of every line of `_lines`."""
    if "hysteresis_loss" not in dataset:
        return {"rows": [], "parts": {}, "count": 0}
    status = dataset["status"].transpose(*LABELS)
    whole = (status.values == COMPLETE) & np.isfinite(_of_runs(dataset, "hysteresis_loss"))
    lines: dict[tuple, list] = {}
    for place in np.argwhere(whole).tolist():
        labels = zip(LABELS, labels_at(dataset, place, LABELS), strict=True)
        line = tuple((label, value) for label, value in labels if label != "seed")
        lines.setdefault(line, []).append(tuple(place))
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
        **dict(line),
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
