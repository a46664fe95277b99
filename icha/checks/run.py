"""Checks of one run: physical identities and limits that are computed from the dataset of the run alone."""

from collections.abc import Hashable, Iterable, Iterator, Mapping
from types import SimpleNamespace

import numpy as np
import xarray as xr

from icha.checks.findings import IDENTITY_LIMIT, Check, RunArrays, compare_with_limit
from icha.checks.loops import EVENT_COUNTS, OF_ENERGIES, OF_LOOPS, check_loop, finite_stiffness
from icha.contact.attraction import FINITE_RANGE, SHORT_RANGE
from icha.contact.model import AREA_FRACTION, PRESSURE
from icha.contact.models import AREA_TOLERANCE_CELLS, AREA_TOLERANCE_PART, SMALLEST_LOAD, model_of
from icha.datasets.variables.run import INDENTER, LOOP, OF_MODELS, RUN
from icha.datasets.variables.terms import INFINITE
from icha.path.targets import AREAS, BETWEEN, LOADS, MEAN_SEPARATION, QUANTITIES

# Largest error of an equilibrium, in h_rms, and largest relative error of a target. Boundary elements meet loads and
# areas to 1e-6 (`PathAccuracy.target`).
RESIDUAL_LIMIT = 1e-8
TARGET_LIMIT = 1e-8
# Largest residual of contact edges (fronts) of boundary elements. Residuals reach 1e-6, or stagnate below this limit.
FRONT_LIMIT = 1e-3
# Largest decrease of the contact area of boundary elements, divided by the largest area. The position of a front within
# a cell has an error, so the computed area may decrease a little when a front enters another cell.
CELL_LIMIT = 1e-3
# Largest rise of the mean separation, in h_rms, in a step in which spots unite. After a union, the same load may need a
# larger separation.
SEPARATION_RISE_LIMIT = 1e-2
_MAY_BE_INFINITE = {
    name for name, description in (RUN | LOOP | OF_MODELS | INDENTER).items() if INFINITE in description.further
}

# Meanings of all checks by name.
_MEANINGS = {
    **OF_LOOPS,
    **OF_ENERGIES,
    "finite": "number of values that are not finite",
    "steps": "1 if the run has no steps, otherwise 0",
    "residual": "largest equilibrium error divided by h_rms",
    "front": OF_MODELS["front_residual"].long_name,
    "gap": OF_MODELS["gap_residual"].long_name,
    "converged": "number of steps that did not converge",
    "targets": "largest relative difference between the value of a step and its target, beyond two cells or a tenth of "
    "an area that is counted in cells (boundary elements without adhesion or at a finite range)",
    "area rises": "largest decrease of A/A0 in the first loading, from target to target or in a step without unions "
    "and jumps, divided by the largest A/A0",
    "pressure rises": "largest decrease of the nominal pressure in the first loading, from target to target or in a "
    "step without unions, divided by the largest pressure",
    "separation falls": "largest rise of mean separation/h_rms in a step of the first loading without unions",
    "separation falls where spots unite": "largest rise of mean separation/h_rms in a step of the first loading with "
    "unions",
    "stiffness": "number of steps with a negative contact stiffness, without adhesion",
    "area from P(p)": "relative difference between the integral of P(p) and A/A0",
    "load from P(p)": "difference between the integral of p P(p) and F/A0, divided by compression plus tension",
    "P(u) complete": "integral of P(u) plus A/A0 within the edges plus overlap fraction, minus 1",
    "area of spots": "relative difference between the sum of the areas of spots and A/A0",
    "load of spots": "difference between the sum of the forces of spots and F, divided by compression plus tension",
}


def check_run(run: xr.Dataset, subject: str = "") -> tuple[Check, ...]:
    """Return the results of all checks of a run from `icha.simulate`; `subject` is the name of the run."""
    return check_variables(run.variables, run.attrs, subject)


def check_variables(
    variables: Mapping[Hashable, xr.Variable], attrs: Mapping[str, str], subject: str
) -> tuple[Check, ...]:
    """Return the results of all checks of a run, from its variables and attributes."""
    values = {str(name): variable.values for name, variable in variables.items()}
    sizes = {str(dim): size for variable in variables.values() for dim, size in variable.sizes.items()}
    findings = _check(RunArrays(values, sizes, attrs))
    return tuple(compare_with_limit(name, value, limit, _MEANINGS[name], subject) for name, value, limit in findings)


def _check(run: RunArrays) -> Iterator[tuple]:
    """Yield name, value and limit of every check of a run."""
    numbers = {name: own for name, own in run.items() if own.dtype.kind in "fiu"}
    values = (own[~np.isposinf(own)] if name in _MAY_BE_INFINITE else own for name, own in numbers.items())
    yield "finite", sum(np.count_nonzero(~np.isfinite(own)) for own in values), 0
    steps = run.sizes["step"]
    yield "steps", int(steps == 0), 0
    if steps == 0:
        return
    yield "residual", np.max(run["residual"]), RESIDUAL_LIMIT
    for variable, name, limit in (("front_residual", "front", FRONT_LIMIT), ("gap_residual", "gap", RESIDUAL_LIMIT)):
        if variable in run:
            yield name, np.max(run[variable]), limit
    yield "converged", np.count_nonzero(run["converged"] != 1), 0
    yield "targets", _target_error(run), max(TARGET_LIMIT, model_of(run.attrs).accuracy.target)
    yield from _check_loading(run)
    if run.sizes.get("snapshot", 0):
        for name, value in _identity_errors(run):
            yield name, value, IDENTITY_LIMIT
    if "work" in run:
        logged = np.bincount(run["event_kind"], minlength=len(EVENT_COUNTS))
        yield "events", np.abs(logged - [int(run[name][-1]) for name in EVENT_COUNTS]).sum(), 0
        if "hysteresis_loss" in run:
            yield from check_loop(run)


def _check_loading(run) -> Iterator[tuple]:
    """Yield name, value and limit of the checks of the first loading, and of the stiffness check in all steps."""
    first = run["leg"] == 0  # unloading may follow other curves
    names = (
        "contact_area_fraction",
        "nominal_pressure",
        "mean_separation",
        "step_kind",
        "step_target",
        "coalescence_count",
        "jump_in_count",
    )
    loading = _without_overshoots({name: run[name][first] for name in names})
    adhesive, height = float(run["surface_energy"]) > 0, float(run["unit_height"])
    # Two targets of different kinds may lead to states that differ only by the error of the solver.
    limit = CELL_LIMIT if model_of(run.attrs).by_cells else TARGET_LIMIT
    yield "area rises", _largest_fall_in_loading(loading, "contact_area_fraction", jumps=adhesive), limit
    if not adhesive:
        # With adhesion the load may fall between targets that are separations or areas.
        yield "pressure rises", _largest_fall_in_loading(loading, "nominal_pressure"), TARGET_LIMIT
    rise, rise_at_unions = _largest_rises_of_separation(loading)
    yield "separation falls", rise / height, TARGET_LIMIT
    yield "separation falls where spots unite", rise_at_unions / height, SEPARATION_RISE_LIMIT
    if not adhesive:
        yield "stiffness", np.count_nonzero(run["contact_stiffness"] < 0), 0


def _without_overshoots(loading):
    """Leave out states from which the path went back to a target.

    If a jump passes a target, the path first reaches the state after the jump, and then goes back on the new branch.
    """
    back = (loading["step_kind"][1:] != BETWEEN) & (np.diff(loading["mean_separation"]) > 0)
    kept = np.append(~(back & (loading["step_kind"][:-1] == BETWEEN)), True)
    return {name: values[kept] for name, values in loading.items()}


def _largest_fall_in_loading(loading, name, *, jumps=False):
    """Return the largest decrease of a variable between targets or steps, divided by the largest magnitude.

    At the same separation, two spots may carry less load after their union than before. Therefore the variable may
    decrease in a step in which spots unite, but not from one target to the next. It may also decrease in `_retreats`.
    With adhesion (`jumps`), the load falls where a part of the surface jumps into contact. Then the contact may recede
    elsewhere, because the surfaces attract each other more strongly at the same separation.
    """
    values, at_targets = loading[name], loading["step_kind"] != BETWEEN
    apart = (np.diff(loading["coalescence_count"], prepend=0) != 0) | _retreats(loading)
    if jumps:
        apart |= np.diff(loading["nominal_pressure"], prepend=-np.inf) < 0
    united = np.cumsum(apart)
    parts = [values[at_targets], *(values[united == count] for count in np.unique(united))]
    fall = max(float(np.max(-np.diff(part), initial=0.0)) for part in parts)
    return fall / (float(np.max(np.abs(values))) or 1.0)


def _largest_rises_of_separation(loading):
    """Return the largest rise of the mean separation, m, in steps without unions, and in steps with unions.

    Steps in which the area increases to a target that is an area, zero load or tension are ignored, because the
    separation may rise in such a step. If the contact jumps past a target, the path meets the target on the branch
    after the jump; see also `_retreats`.
    """
    rise = np.diff(loading["mean_separation"])
    ignored = np.isin(loading["step_kind"], AREAS)
    ignored |= np.isin(loading["step_kind"], LOADS) & (loading["step_target"] <= 0)
    ignored = ignored[1:] & (np.diff(loading["contact_area_fraction"]) > 0) | _retreats(loading)[1:]
    united = np.diff(loading["coalescence_count"]) != 0
    return tuple(float(np.max(rise[where & ~ignored], initial=0.0)) for where in (~united, united))


def _retreats(loading):
    """Return whether each step leads back from a jump into contact to an area target inside the jump."""
    rises = np.diff(loading["mean_separation"], prepend=np.inf) > 0
    jumped = (np.diff(loading["jump_in_count"], prepend=0) > 0) & (loading["step_kind"] == BETWEEN)
    return rises & np.roll(jumped, 1) & np.isin(loading["step_kind"], AREAS)


def _target_error(run):
    """Return the largest relative error of a target; areas counted in cells may differ by the area tolerance."""
    modulus, adhesive = float(run["contact_modulus"]), float(run["surface_energy"]) > 0
    contact = SimpleNamespace(
        area=float(run["period"]) ** 2, contact_modulus=modulus, pressure_unit=modulus * float(run["unit_slope"])
    )
    states = {PRESSURE: run["nominal_pressure"], AREA_FRACTION: run["contact_area_fraction"]}
    states[None] = run["mean_separation"]
    kinds = [MEAN_SEPARATION if kind == BETWEEN else str(kind) for kind in run["step_kind"]]
    asked = [QUANTITIES[kind] for kind in kinds]
    # Pressures (Pa), area fractions and separations (m).
    target = np.array([each.prescribed(contact, value) for each, value in zip(asked, run["step_target"], strict=True)])
    error = np.abs(np.array([states[each.controlled][k] for k, each in enumerate(asked)]) - target)
    if model_of(run.attrs).by_cells and run.attrs.get("attraction") != SHORT_RANGE:
        cells = np.minimum(AREA_TOLERANCE_CELLS / float(run["grid"]) ** 2, AREA_TOLERANCE_PART * np.abs(target))
        error = np.where(np.isin(kinds, AREAS), np.maximum(error - cells, 0.0), error)
    # If the target is zero load, the error is relative to the largest load of the run.
    largest = np.array([np.max(np.abs(states[each.controlled])) for each in asked])
    # With adhesion a load may be a small difference of attraction and repulsion. Each of them is about as large as the
    # stiffness times h_rms. Therefore the error of a very small load is relative to SMALLEST_LOAD times this product.
    gross = np.abs(finite_stiffness(run)) * float(run["unit_height"]) * adhesive
    least = np.where(np.isin(kinds, LOADS), SMALLEST_LOAD * gross, 0.0)
    return np.max(error / np.where(target != 0, np.maximum(np.abs(target), least), largest))


def _identity_errors(run):
    """Yield name and largest error of every identity between distributions, spots and step of a snapshot."""
    at = run["snapshot_step"].astype(int)
    area = run["contact_area_fraction"][at]
    pressure = run["nominal_pressure"][at]
    # Before first contact both sides of an identity are zero.
    area_scale = np.maximum(area, np.finfo(float).tiny)

    pressure_content = run["pressure_density"] * np.diff(run["pressure_bin_edges"])
    load = pressure_content * run["pressure_bin_mean"]
    gap_content = run["gap_density"] * np.diff(run["gap_bin_edges"])
    # With adhesion, tension and compression nearly cancel. Therefore errors are relative to the sum of magnitudes.
    load_scale = np.maximum(np.abs(load).sum(axis=1), np.finfo(float).tiny)

    cell = float(run["period"]) ** 2
    snapshot = run["spot_snapshot"].astype(int)
    spot_area = np.bincount(snapshot, run["spot_area"] / cell, len(at))
    spot_load = np.bincount(snapshot, run["spot_force"] / cell, len(at))

    yield "load from P(p)", np.max(np.abs(load.sum(axis=1) - pressure) / load_scale)
    whole = gap_content.sum(axis=1) + area - run["area_beyond_edges"] + run["overlap_fraction"]
    yield "P(u) complete", np.max(np.abs(whole - 1))
    yield "area of spots", np.max(np.abs(spot_area - area) / area_scale)
    if run.attrs.get("attraction") == FINITE_RANGE:
        return  # Tension also acts across gaps, so P(p) and the load include more than the spots.
    yield "area from P(p)", np.max(np.abs(pressure_content.sum(axis=1) - area) / area_scale)
    yield "load of spots", np.max(np.abs(spot_load - pressure) / load_scale)


def attributes_of_failure(checks: Iterable[Check]) -> dict[str, str]:
    """Return the attribute of a run that names its failed checks in one line; no attribute if all checks have passed.

    The attribute is `failed_loss_checks` if only the values of the hysteresis loss are not valid, and `failed_checks`
    otherwise.
    """
    failed = [check for check in checks if not check.passed]
    if not failed:
        return {}
    reasons = (
        f"{check.name}: {check.value:.3g} ({check.description}); expected at most {check.limit:.3g}" for check in failed
    )
    only_loss = all(check.name in OF_ENERGIES for check in failed)
    return {"failed_loss_checks" if only_loss else "failed_checks": "; ".join(reasons)}
