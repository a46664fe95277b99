"""Checks of one run: finite, converged, on target, monotone, and true to its identities.

They are identities and bounds of the physics, evaluated on the dataset alone.
"""

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping

import numpy as np
import xarray as xr

from icha.checks.findings import IDENTITY_LIMIT, Check, Finding, RunArrays, at_most, not_finite
from icha.checks.loops import check_events, check_loop
from icha.contact.models import HELD_CELLS, HELD_PART, SMALLEST_LOAD, model_of
from icha.datasets.variables.run import OF_MODELS, RUN
from icha.datasets.variables.terms import INFINITE
from icha.path.targets import AREA_FRACTION, BETWEEN

RESIDUAL_LIMIT = 1e-8
TARGET_LIMIT = 1e-8
# Residual of a front of boundary elements that has converged, or stagnated and is accepted.
FRONT_LIMIT = 1e-4
# Where they are within their cells is known less well, so that the area may seem to fall by a little where they enter
# others.
CELL_LIMIT = 1e-3
# Where spots unite, the same load may need the surfaces further apart by a little, in units of h_rms.
SEPARATION_RISE_LIMIT = 1e-2
_MAY_BE_INFINITE = {name for name, description in RUN.items() if INFINITE in description.further}


def check_run(run: xr.Dataset, subject: str = "") -> tuple[Check, ...]:
    """Check a run dataset: finite, converged, on target, monotone, and true to the identities of its distributions.

    Parameters
    ----------
    run : a dataset as `icha.simulate` returns it.
    subject : name of the run in the findings.
    """
    return checked(run.variables, run.attrs, subject)


def checked(variables: Mapping[Hashable, xr.Variable], attrs: Mapping[str, str], subject: str) -> tuple[Check, ...]:
    """The checks of a run of these variables and attributes."""
    values = {str(name): variable.values for name, variable in variables.items()}
    sizes = {str(dim): size for variable in variables.values() for dim, size in variable.sizes.items()}
    return tuple(at_most(*finding, subject) for finding in _findings(RunArrays(values, sizes, attrs)))


def _findings(run: RunArrays) -> Iterator[Finding]:
    values = (own[~np.isposinf(own)] if name in _MAY_BE_INFINITE else own for name, own in run.values.items())
    yield "finite", not_finite(values), 0, "number of values that are not finite"
    steps = run.sizes["step"]
    yield "steps", int(steps == 0), 0, "1 if the run has no step at all"
    if steps == 0:
        return
    yield "residual", np.max(run["residual"]), RESIDUAL_LIMIT, "largest equilibrium error over h_rms"
    yield from _fronts(run)
    yield "converged", np.count_nonzero(run["converged"] != 1), 0, "number of steps that did not converge"
    yield "targets", _miss(run), TARGET_LIMIT, "largest relative distance of a step from its target"
    yield from _loading(run)
    if run.sizes.get("snapshot", 0):
        for name, value, description in _identities(run):
            yield name, value, IDENTITY_LIMIT, description
    if "work" in run:
        yield from check_events(run)
        if "hysteresis_loss" in run:
            yield from check_loop(run)


def _fronts(run) -> Iterator[Finding]:
    """Findings on the edges of contact, of boundary elements."""
    for name, short, limit in (
        ("front_residual", "front", FRONT_LIMIT),
        ("gap_residual", "gap", RESIDUAL_LIMIT),
    ):
        if name in run:
            yield short, np.max(run[name]), limit, OF_MODELS[name].long_name


# What the findings on the first loading are made of.
_OF_LOADING = (*("contact_area_fraction", "nominal_pressure", "mean_separation", "step_kind", "coalescence_count"),)


def _loading(run) -> Iterator[Finding]:
    """Findings on the first loading: the way back is another curve, and so is loading again."""
    first = run["leg"] == 0
    loading = {name: run[name][first] for name in _OF_LOADING}
    adhesive, height = float(run["surface_energy"]) > 0, float(run["rms_height"])
    by_cells = model_of(run.attrs).by_cells
    # Two targets of different kinds may be one state but for the accuracy to which it is reached.
    yield (
        "area rises",
        _fall_in_loading(loading, "contact_area_fraction"),
        CELL_LIMIT if by_cells else TARGET_LIMIT,
        "largest fall of A/A0 within the first loading, between stops or where nothing unites, over its maximum",
    )
    if not adhesive:
        # Adhesion may pull the surfaces together: between stops in separation or area the load is then free to fall.
        yield (
            "pressure rises",
            _fall_in_loading(loading, "nominal_pressure"),
            TARGET_LIMIT,
            "largest fall of the nominal pressure within the first loading, between stops or where nothing unites, "
            "over its maximum",
        )
    rise, rise_at_unions = _rises_of_separation(loading)
    yield (
        "separation falls",
        rise / height,
        TARGET_LIMIT,
        "largest rise of the mean separation within the first loading where no spots unite, over h_rms",
    )
    yield (
        "separation falls where spots unite",
        rise_at_unions / height,
        SEPARATION_RISE_LIMIT,
        "largest rise of the mean separation within the first loading where spots unite, over h_rms",
    )
    if not adhesive:
        yield (
            "stiffness",
            np.count_nonzero(run["contact_stiffness"] < 0),
            0,
            "number of steps with a negative contact stiffness, without adhesion",
        )


def _fall(values):
    """Largest fall from one value to the next; 0 if there is none."""
    return float(np.max(-np.diff(values), initial=0.0))


def _fall_in_loading(loading, name):
    """Largest fall of a variable from stop to stop and from step to step, over its largest absolute value.

    Where two spots unite in one, it may carry less than both did at the same separation: a step may fall there, but no
    stop may.
    """
    values, stops = loading[name], loading["step_kind"] != BETWEEN
    united = np.cumsum(np.diff(loading["coalescence_count"], prepend=0) != 0)
    parts = [values[stops], *(values[united == part] for part in np.unique(united))]
    return max(map(_fall, parts)) / (float(np.max(np.abs(values))) or 1.0)


def _rises_of_separation(loading):
    """Largest rise of the mean separation from step to step, m: where no spots unite, and where they do.

    At a given load a contact that grows draws the surfaces together. At a given area it may push them apart: where the
    area jumps past a target, the target is met on the way back.
    """
    rise = np.diff(loading["mean_separation"])
    given_area = (loading["step_kind"][1:] == AREA_FRACTION) & (np.diff(loading["contact_area_fraction"]) > 0)
    united = np.diff(loading["coalescence_count"]) != 0
    return tuple(float(np.max(rise[where & ~given_area], initial=0.0)) for where in (~united, united))


def _miss(run):
    """Largest relative distance between what was asked of a step and what it has; of areas in cells, beyond those."""
    scale = float(run["contact_modulus"])
    reached = {
        "reduced_pressure": run["reduced_pressure"],
        "relative_load": run["nominal_pressure"] / scale,
        "area_fraction": run["contact_area_fraction"],
        "mean_separation": run["mean_separation"],
        BETWEEN: run["mean_separation"],
    }
    target, kinds = run["step_target"], [str(kind) for kind in run["step_kind"]]
    value = np.array([reached[kind][k] for k, kind in enumerate(kinds)])
    miss = np.abs(value - target)
    if model_of(run.attrs).by_cells and float(run["surface_energy"]) == 0:
        of_area = np.array([kind == AREA_FRACTION for kind in kinds])
        cells = np.minimum(HELD_CELLS / float(run["grid"]) ** 2, HELD_PART * np.abs(target))
        miss = np.where(of_area, np.maximum(miss - cells, 0.0), miss)
    # A path may turn back at no load, of which no part can be taken: then it is one of the run's largest load.
    whole = np.array([np.max(np.abs(reached[kind])) for kind in kinds])
    # With adhesion a load may be next to nothing beside the attraction and repulsion of which it is made up, which are
    # about the stiffness times h_rms: it is met as well as they are.
    gross = np.abs(run["contact_stiffness"]) * float(run["rms_height"]) * (float(run["surface_energy"]) > 0)
    unit = {"reduced_pressure": scale * float(run["rms_slope"]), "relative_load": scale}
    least = np.array([SMALLEST_LOAD * gross[k] / unit.get(kind, math.inf) for k, kind in enumerate(kinds)])
    return np.max(miss / np.where(target != 0, np.maximum(np.abs(target), least), whole))


def _identities(run):
    """Largest errors of the identities between a snapshot's distributions and spots, and its step."""
    at = run["snapshot_step"].astype(int)
    area = run["contact_area_fraction"][at]
    pressure = run["nominal_pressure"][at]

    # Before first contact there is no area to compare with, and both sides are zero.
    area_scale = np.maximum(area, np.finfo(float).tiny)

    pressure_content = run["pressure_density"] * np.diff(run["pressure_bin_edges"])
    load = pressure_content * run["pressure_bin_mean"]
    gap_content = run["gap_density"] * np.diff(run["gap_bin_edges"])
    # With adhesion tension and compression nearly cancel: errors are measured against the sum of both.
    load_scale = np.maximum(np.abs(load).sum(axis=1), np.finfo(float).tiny)

    cell = float(run["period"]) ** 2
    snapshot = run["spot_snapshot"].astype(int)
    spot_area = np.bincount(snapshot, run["spot_area"] / cell, len(at))
    spot_load = np.bincount(snapshot, run["spot_force"] / cell, len(at))

    yield (
        "area from P(p)",
        np.max(np.abs(pressure_content.sum(axis=1) - area) / area_scale),
        "integral of P(p) over p against A/A0",
    )
    yield (
        "load from P(p)",
        np.max(np.abs(load.sum(axis=1) - pressure) / load_scale),
        "integral of p P(p) over p against F/A0, over the sum of compression and tension",
    )
    overlap = run["overlap_fraction"]
    yield (
        "P(u) complete",
        np.max(np.abs(gap_content.sum(axis=1) + area - run["area_beyond_edges"] + overlap - 1)),
        "integral of P(u) over u, plus A/A0 within the edges, plus overlap, against 1",
    )
    yield "area of spots", np.max(np.abs(spot_area - area) / area_scale), "sum of the spots' areas against A/A0"
    yield (
        "load of spots",
        np.max(np.abs(spot_load - pressure) / load_scale),
        "sum of the spots' forces against F/A0, over the sum of compression and tension",
    )


def reasons_of_failure(checks: Iterable[Check]) -> str:
    """Join the failed checks in one line; an empty text if all have passed."""
    return "; ".join(
        f"{check.name}: {check.value:.3g} ({check.description}); expected at most {check.limit:.3g}"
        for check in checks
        if not check.passed
    )
