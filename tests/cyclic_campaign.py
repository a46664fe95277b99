"""Runs with unloading, made from loading runs, whose works are known."""

from functools import cache

import numpy as np
import small_campaign as small
import xarray as xr

import icha
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.variables.terms import MATERIAL
from icha.path.energy_balance import summarise_loop

# In units of the largest pressure: by how much unloading with adhesion lies below loading; a tenth more for every step
# between the stops, so that runs differ.
TENSION = 0.3
_COORDINATES = ["branch", "reduced_pressure", "reduced_separation"]
_UNKNOWN = {"units": "1", "long_name": "test"}


def unloaded(run, between=0):
    """Return a run with unloading to complete separation.

    Without adhesion unloading follows the loading curve. With it the pressure is less by `TENSION` of the largest one,
    up to the jump-off that ends all contact. Nothing coalesces. There are `between` more steps between the last two
    targets.
    """
    adhesive = float(run["surface_energy"]) > 0
    run = run.drop_vars(["leg", "split_count", "control"]).reset_coords(_COORDINATES)
    count = run.sizes["step"]
    stops = np.insert(np.arange(count, dtype=float), count - 1, count - 2 + np.arange(1, between + 1) / (between + 1))
    back = np.append(stops[-2::-1], -1.0)
    at = np.concatenate([stops, back])
    first = len(stops)
    leg = np.repeat([0, 1], [first, len(back)])
    whole, ended = np.maximum(at, 0).astype(int), np.arange(len(at)) == len(at) - 1
    of_steps = {name: variable.values for name, variable in run.data_vars.items() if variable.dims == ("step",)}
    columns = {
        name: np.interp(at, np.arange(count), values) if values.dtype.kind == "f" else values[whole]
        for name, values in of_steps.items()
    }
    between_stops = (at % 1 != 0) | (leg > 0)
    drop = TENSION * (1 + 0.1 * between) * columns["nominal_pressure"].max() if adhesive else 0.0
    unit = float(run["contact_modulus"] * run["rms_slope"])
    columns["nominal_pressure"] = columns["nominal_pressure"] - drop * leg
    columns["mean_separation"][-1] *= 1.5
    for name in ("nominal_pressure", "contact_area_fraction", "spot_count", "contact_stiffness"):
        columns[name][-1] = 0
    columns["reduced_pressure"] = columns["nominal_pressure"] / unit
    columns["reduced_separation"] = columns["mean_separation"] / float(run["rms_height"])
    columns |= {"branch": np.where(leg == 0, "loading", "unloading").astype(object), "leg": leg}
    columns |= dict.fromkeys(("split_count", "coalescence_count"), np.zeros(len(at), int))
    columns["step_kind"] = np.where(between_stops, "path", columns["step_kind"]).astype(object)
    columns["step_target"] = np.where(between_stops, columns["mean_separation"], columns["step_target"])
    spots = run["spot_count"].values
    columns["jump_in_count"] = np.where(leg == 0, spots[whole], spots[-1])
    columns["jump_off_count"] = np.where(ended, spots[-1], 0)

    # First contact has no load. Before the last step, the jump-off, the work is the area between both curves; all other
    # work is stored.
    p, u = columns["nominal_pressure"], columns["mean_separation"]
    work = np.concatenate([[0.0], np.cumsum(-0.5 * (p[1:] + p[:-1]) * np.diff(u))])
    work[-1] = work[-1] if adhesive else 0.0
    columns |= {"work": work, "dissipated_by_jump_off": np.where(ended, work[-1], 0.0)}
    for name in ("jump_in", "coalescence", "load_jump", "front"):
        columns[f"dissipated_by_{name}"] = np.zeros(len(at))
    columns["stored_energy"] = work - columns["dissipated_by_jump_off"]

    kinds = np.repeat(np.array([0, 1], np.int8), [spots[-1], spots[-1]])
    formed = np.searchsorted(columns["jump_in_count"], np.arange(1, spots[-1] + 1))
    steps = np.append(formed, np.full(spots[-1], len(at) - 1))
    x = np.tile(np.linspace(0, float(run["period"]), spots[-1]), 2)
    events = {
        "event_kind": kinds,
        "event_step": steps,
        "event_separation": u[steps],
        "event_x": x,
        "event_y": x[::-1],
        "event_members": np.ones(len(kinds), int),
    }
    material = icha.Material(*(float(run[name]) for name in MATERIAL))
    rows = [{name: values[k] for name, values in columns.items()} for k in range(len(at))]
    pull_off = int(np.argmin(np.where(leg == 1, p, np.inf)))
    scalars = summarise_loop(rows, pull_off, material, 4 * max(-p[pull_off], 0.0), 0.0, 0.0)
    scalars |= {"uphill_jump_in_count": 0, "detachment_pressure": p[-2] if adhesive else 0.0}
    kept = run.drop_dims("step").assign_attrs(run.attrs)
    new = {name: ("step", values, run[name].attrs if name in run else _UNKNOWN) for name, values in columns.items()}
    new |= {name: ("event", values, _UNKNOWN) for name, values in events.items()}
    new |= {name: ((), value, _UNKNOWN) for name, value in scalars.items()} | {"control": ((), "separation", _UNKNOWN)}
    # A stop keeps its snapshot, wherever it now stands.
    new["snapshot_step"] = run["snapshot_step"].copy(data=np.searchsorted(at[:first], run["snapshot_step"].values))
    step = ("step", np.arange(len(at)), run["step"].attrs)
    return kept.assign(new).assign_coords(step=step).set_coords(_COORDINATES)


@cache
def run(seed=1, material="soft", between=0):
    return unloaded(small.run(seed=seed, material=material), between)


PULL = RunLabels("pull", "boundary_elements", "rough", 1, 1.0, "soft")


def pulls(seeds, change=lambda seed, run: run):
    """Return labels and runs of loops of boundary elements, each changed by a function of seed and run."""
    tension = xr.Variable((), 1.0, {"units": "Pa", "long_name": "test"})
    return [
        (
            PULL._replace(seed=seed),
            change(seed, run(seed).assign(resolved_tension=tension).assign_attrs(contact_model=PULL.model)),
        )
        for seed in seeds
    ]


@cache
def runs():
    """Return the runs of a study with unloading of different lengths, and of a study that only loads."""
    between = {(1, "soft"): 1, (1, "hertz"): 0, (2, "soft"): 4, (2, "hertz"): 3}
    loops = {
        RunLabels("loops", "asperities", "rough", seed, 1.0, material): run(seed, material, count)
        for (seed, material), count in between.items()
    }
    return loops | {labels: run for labels, run in small.runs() if labels.study == "single"}


@cache
def tree():
    return campaign_tree(runs().items(), attrs={"title": "Cyclic campaign", "summary": "For tests."})
