"""Checks of results: what every run must satisfy, whoever computed it.

They are identities and bounds of the physics, evaluated on the dataset alone.
"""

import json
import math
import os
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from icha.asperity.cohesive_zone import MAX_STRENGTH_NUMBER
from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS
from icha.contact.tolerances import HELD_CELLS, HELD_PART, RESIDUAL_TOLERANCE, SMALLEST_LOAD, STIFFNESS_TOLERANCE
from icha.datasets.campaign import run_labels, variables_of_run
from icha.datasets.labels import RunLabels
from icha.datasets.variables.campaign import MISSING
from icha.datasets.variables.run import PATCHES, RUN
from icha.datasets.variables.terms import INFINITE
from icha.path.limits import UNBALANCED_WORK, UNRESOLVED_LOSS, UNRESOLVED_REST
from icha.path.open_work import integration_error, pressure_jump, unresolved_work
from icha.path.targets import AREA_FRACTION, BETWEEN
from icha.support.atomic_files import whole_file

RESIDUAL_LIMIT = 1e-8
IDENTITY_LIMIT = 1e-8
TARGET_LIMIT = 1e-8
# Fronts of boundary elements come to rest to 1e-9.
FRONT_LIMIT = 1e-8
# Where they are within their cells is known less well, so that the area may seem to fall by a little where they enter
# others.
CELL_LIMIT = 1e-3
# The mean gap that carries a load is searched for to 2e-4 of the load.
LOAD_LIMIT = 1e-3
# Where spots unite, the same load or area may need the surfaces further apart by a little, in units of h_rms. Where
# they jump in, by as much as the jump gives: that has no limit.
SEPARATION_RISE_LIMIT = 1e-2
# The check of every run of a campaign that it reached its end.
COMPLETED = "completed"

_MAY_BE_INFINITE = {name for name, description in RUN.items() if INFINITE in description.further}

# Name, value, limit and description of what is checked.
Finding = tuple[str, float, float, str]


@dataclass(frozen=True)
class Check:
    """One finding: `passed` says whether `value` keeps to `limit`; `subject` is the run it belongs to."""

    name: str
    value: float
    limit: float
    passed: bool
    description: str
    subject: str = ""


def check_run(run: xr.Dataset, subject: str = "") -> tuple[Check, ...]:
    """Check a run dataset: finite, converged, on target, monotone, and true to the identities of its distributions.

    Parameters
    ----------
    run : a dataset as `icha.simulate` returns it.
    subject : name of the run in the findings.
    """
    return _checked(run.variables, run.attrs, subject)


@dataclass(frozen=True)
class _Run:
    """A run as bare arrays: of thousands of small runs, labels take many times as long as the checks."""

    values: dict[str, np.ndarray]
    sizes: dict[str, int]
    attrs: Mapping[str, str]

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]


def _checked(variables: Mapping[Hashable, xr.Variable], attrs: Mapping[str, str], subject: str) -> tuple[Check, ...]:
    """The checks of a run of these variables and attributes."""
    values = {str(name): variable.values for name, variable in variables.items()}
    sizes = {str(dim): size for variable in variables.values() for dim, size in variable.sizes.items()}
    return tuple(_at_most(*finding, subject) for finding in _findings(_Run(values, sizes, attrs)))


def _findings(run: _Run) -> Iterator[Finding]:
    values = (own[~np.isposinf(own)] if name in _MAY_BE_INFINITE else own for name, own in run.values.items())
    yield "finite", _not_finite(values), 0, "number of values that are not finite"
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
        yield from _cycle(run)
        if "hysteresis_loss" in run:
            yield from _loop(run)


def _fronts(run) -> Iterator[Finding]:
    """Findings on the edges of contact, of boundary elements."""
    for name, short, limit in (
        ("front_residual", "front", FRONT_LIMIT),
        ("gap_residual", "gap", RESIDUAL_LIMIT),
    ):
        if name in run:
            yield short, np.max(run[name]), limit, PATCHES[name].long_name


def _not_finite(arrays):
    """Number of values that are not finite."""
    return sum(int(np.count_nonzero(~np.isfinite(values))) for values in arrays if values.dtype.kind in "fiu")


# What the findings on the first loading are made of.
_OF_LOADING = (
    *("contact_area_fraction", "nominal_pressure", "mean_separation", "step_kind"),
    *("jump_in_count", "coalescence_count"),
)


def _loading(run) -> Iterator[Finding]:
    """Findings on the first loading: the way back is another curve, and so is loading again."""
    first = run["leg"] == 0
    loading = {name: run[name][first] for name in _OF_LOADING}
    adhesive, height = float(run["surface_energy"]) > 0, float(run["rms_height"])
    by_cells = run.attrs.get("contact_model") == BOUNDARY_ELEMENTS
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
    # Within a patch a front may jump as well, as fronts of cells do, and only the area tells.
    rise, rise_at_events = _rises_of_separation(loading, or_wider=adhesive and by_cells)
    yield (
        "separation falls",
        rise / height,
        TARGET_LIMIT,
        "largest rise of the mean separation within the first loading where nothing jumps in, unites or, of cells with "
        "adhesion, becomes wider, over h_rms",
    )
    if not adhesive:
        yield (
            "separation falls where spots unite",
            rise_at_events / height,
            SEPARATION_RISE_LIMIT,
            "largest rise of the mean separation within the first loading where spots unite, over h_rms",
        )
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


def _rises_of_separation(loading, *, or_wider):
    """Largest rise of the mean separation from step to step, m: where nothing jumps in or unites, and elsewhere.

    or_wider: where the area grows, something happened, too: surfaces that come apart without a jump lose contact.
    """
    rise = np.diff(loading["mean_separation"])
    happened = np.diff(loading["jump_in_count"]) + np.diff(loading["coalescence_count"]) != 0
    if or_wider:
        happened |= np.diff(loading["contact_area_fraction"]) > 0
    return tuple(float(np.max(rise[where], initial=0.0)) for where in (~happened, happened))


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
    if run.attrs.get("contact_model") == BOUNDARY_ELEMENTS and float(run["surface_energy"]) == 0:
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


# What the hysteresis loss of a run consists of.
LOSSES = ("loss_by_jump_in", "loss_by_jump_off", "loss_by_coalescence", "loss_by_load_jump", "loss_unattributed")
# The counts of events in a run, in the order of the flags of `event_kind`.
EVENT_COUNTS = ("jump_in_count", "jump_off_count", "coalescence_count", "split_count")


def _largest_work(run):
    """The scale of energies of a run: as differences of works they are as accurate as the largest of those."""
    return float(np.max(np.abs(run["work"]))) or 1.0


def _cycle(run) -> Iterator[Finding]:
    """Findings on the events of a run that goes on after its first loading."""
    logged = np.bincount(run["event_kind"], minlength=len(EVENT_COUNTS))
    counted = np.array([int(run[name][-1]) for name in EVENT_COUNTS])
    yield (
        "events",
        np.abs(logged - counted).sum(),
        0,
        "number of events that are counted and not logged, or logged only",
    )


def _loop(run) -> Iterator[Finding]:
    """Findings on a run that ends in separation: its loss, and that nothing is left in contact."""
    scale = _largest_work(run)
    loss = float(run["hysteresis_loss"])
    parts = sum(float(run[name]) for name in LOSSES if name in run)
    yield (
        "loss adds up",
        abs(loss - parts) / scale,
        IDENTITY_LIMIT,
        "hysteresis loss against its parts, over the largest work",
    )
    yield (
        "loss is the work",
        abs(loss - float(run["work"][-1])) / scale,
        IDENTITY_LIMIT,
        "hysteresis loss against the work done up to complete separation, over the largest work",
    )
    # A jump into contact may be uphill, as far as the jump off it is downhill: where the range is so long that Wu's
    # distance would lie below jump-off. Then both cancel, as well as the work of their steps is known.
    jumps = [float(run[f"dissipated_by_{name}"][-1]) for name in ("jump_in", "jump_off")]
    yield (
        "jumps lose energy",
        -min(sum(jumps), 0.0) / scale,
        IDENTITY_LIMIT + (_left_open(run) + _error_of_work(run)) / scale,
        "energy gained in jumps into and out of contact together, over the largest work",
    )
    yield "separated: spots", float(run["spot_count"][-1]), 0, "number of spots left in contact at the end of unloading"
    yield (
        "separated: pressure",
        abs(float(run["nominal_pressure"][-1])),
        0,
        "nominal pressure left at the end of unloading, in Pa",
    )
    back = run["nominal_pressure"][run["leg"] == int(run["leg"][-1])]
    yield (
        "pull-off pressure",
        abs(float(run["pull_off_pressure"]) + back.min()) / (np.abs(back).max() or 1.0),
        IDENTITY_LIMIT,
        "pull-off pressure against the largest tension of the last unloading, over the largest pressure there",
    )
    # What asperities unite by a rule patches do by themselves, and as they came.
    united = run.attrs.get("contact_model") != BOUNDARY_ELEMENTS and int(run["coalescence_count"][-1]) > 0
    if float(run["surface_energy"]) == 0 and not united:
        yield (
            "loop closes",
            abs(loss) / scale,
            IDENTITY_LIMIT + _error_of_work(run) / scale + 3 * UNBALANCED_WORK * _met_one_way(run),
            "hysteresis loss without adhesion or union by rule, where nothing is irreversible, over the largest work",
        )


def _met_one_way(run):
    """At how many separations a path was on a later leg and not on the first.

    There one step of the first is two of the other, and each of the three knows its work only so well.
    """
    first, later = (np.unique(run["mean_separation"][run["leg"] == 0]), run["mean_separation"][run["leg"] > 0])
    same = 10 * RESIDUAL_TOLERANCE * float(run["rms_height"])
    after = np.searchsorted(first, later)
    nearest = np.minimum(
        np.abs(later - first[np.minimum(after, len(first) - 1)]), np.abs(later - first[np.maximum(after - 1, 0)])
    )
    return int(np.count_nonzero(nearest > same))


def _error_of_work(run):
    """By how much the work of a path may be wrong, as its equilibria are found to their tolerances only, J/m^2.

    An error of the separation is one of the pressure, times the stiffness; that of the stiffness enters the integral as
    the stiffness does, by the cubic through both ends of a step.
    """
    way, stiffness = np.abs(np.diff(run["mean_separation"])), run["contact_stiffness"]
    ends = np.abs(stiffness[1:]) + np.abs(stiffness[:-1])
    separation = RESIDUAL_TOLERANCE * float(run["rms_height"])
    relative = STIFFNESS_TOLERANCE[run.attrs.get("contact_model", ASPERITIES)]
    return float(np.sum(way * ends * (0.5 * separation + relative * way / 12)))


def _left_open(run):
    """By how much the work of the steps with events may be wrong, J/m^2, as it is not known where in them those happen.

    An event moves the work by what it changes the pressure by, times its distance from the middle of its step; and one
    that changes the stiffness alone by a part of the difference that this makes to the integral. No step may leave more
    open than UNRESOLVED_LOSS of what jumps have set free, or than UNRESOLVED_REST of the work and losses so far.
    """
    events = sum(np.diff(run[name]) for name in EVENT_COUNTS) > 0
    events &= np.diff(run["dissipated_by_load_jump"]) == 0  # there the pressure is constant
    width, slope = np.diff(run["mean_separation"]), -run["contact_stiffness"]
    jumped = pressure_jump(width, np.diff(run["nominal_pressure"]), slope[:-1], slope[1:])
    work = float(np.sum(events * (unresolved_work(width, jumped) + integration_error(width, slope[:-1], slope[1:]))))
    set_free = sum(abs(float(run[f"dissipated_by_{name}"][-1])) for name in ("jump_in", "jump_off"))
    lost = run["work"] - run["stored_energy"]
    effort = float(np.sum(np.abs(np.diff(run["work"])) + np.abs(np.diff(lost))))
    return min(work, np.count_nonzero(events) * max(UNRESOLVED_LOSS * set_free, UNRESOLVED_REST * effort))


def check_campaign(tree: xr.DataTree, expected: Iterable[RunLabels | tuple] | None = None) -> tuple[Check, ...]:
    """Check a campaign dataset: every run there and complete, every variable described, and `check_run` for each.

    A run that failed has one check, which fails and has the reason as its description.

    Parameters
    ----------
    tree : the campaign dataset.
    expected : labels of the runs that the campaign asks for; those of the dataset's own design, if left out.
    """
    checks = []

    def none_of(name, count, description, subject):
        checks.append(Check(name, float(count), 0.0, bool(count == 0), description, subject))

    wanted = None if expected is None else {str(RunLabels(*labels)) for labels in expected}
    present = run_labels(tree)
    if wanted is not None:
        lacking = wanted - {str(labels) for labels in present}
        none_of(
            "all runs", len(lacking), "number of runs that the campaign asks for and lacks", ", ".join(sorted(lacking))
        )
    for study, node in tree.children.items():
        missing = np.count_nonzero(node["status"].values == MISSING)
        none_of("no run missing", missing, "number of runs of the design that are missing", study)
        variables = node.to_dataset().variables.values()
        bare = sum("units" not in v.attrs or "long_name" not in v.attrs for v in variables)
        none_of("described", bare, "number of variables without units or long name", study)
    for labels in present:
        variables, attrs = variables_of_run(tree, labels)
        # What a failed run has is not used; of it there is nothing to say but why it failed.
        if "incomplete" in attrs:
            checks.append(Check(COMPLETED, 1.0, 0.0, False, attrs["incomplete"], str(labels)))
            continue
        checks.append(Check(COMPLETED, 0.0, 0.0, True, "the run reached the end of its path", str(labels)))
        checks.extend(_checked(variables, attrs, str(labels)))
    return tuple(checks)


def check_solution(solution: xr.Dataset, subject: str = "") -> tuple[Check, ...]:
    """Check a boundary-element solution: finite, converged, resolved, at its load, and true to its identities.

    Parameters
    ----------
    solution : a dataset as `icha.references.finite_range.finite_range_solution` returns it.
    subject : name of the solution in the findings.
    """
    findings = (*_of_solver(solution), *_identities_of_solution(solution))
    return tuple(_at_most(f"boundary elements: {name}", *rest, subject) for name, *rest in findings)


def _of_solver(solution) -> Iterator[Finding]:
    """Findings on how well a solution was found."""
    values = (variable.values for variable in solution.variables.values())
    yield "finite", _not_finite(values), 0, "number of values that are not finite"
    yield (
        "converged",
        float(solution["residual"]) / float(solution["tolerance"]),
        1,
        "error of the solver over the one at which it was to stop",
    )
    load_error = abs(float(solution["nominal_pressure"]) / _asked(solution) - 1)
    yield "load", load_error, LOAD_LIMIT, "mean traction against the load asked for"
    yield (
        "resolved",
        float(solution["strength_number"]),
        MAX_STRENGTH_NUMBER,
        "sqrt(dgamma dx/E*)/range of the grid, 0 without adhesion",
    )


def _asked(solution):
    """The nominal pressure asked for, Pa."""
    unit = float(solution["contact_modulus"]) * float(solution["rms_slope"])
    return float(solution["target_reduced_pressure"]) * unit


def _identities_of_solution(solution) -> Iterator[Finding]:
    """Errors of the identities between a solution's distributions, area and load."""
    gaps = solution["gap_density"].values * np.diff(solution["gap_bin_edges"].values)
    pressures = solution["pressure_density"].values * np.diff(solution["pressure_bin_edges"].values)
    loads = pressures * solution["pressure_bin_mean"].values
    area, nominal = float(solution["contact_area_fraction_raw"]), float(solution["nominal_pressure"])
    yield (
        "P(u) complete",
        abs(gaps.sum() + area - 1),
        IDENTITY_LIMIT,
        "integral of P(u) over u, plus the nodes in contact, against 1",
    )
    yield (
        "area from P(p)",
        abs(pressures.sum() - area) / max(area, np.finfo(float).tiny),
        IDENTITY_LIMIT,
        "integral of P(p) over p against the nodes in contact",
    )
    yield (
        "load from P(p)",
        abs(loads.sum() + float(solution["outside_pressure"]) - nominal) / max(np.abs(loads).sum(), _asked(solution)),
        IDENTITY_LIMIT,
        "integral of p P(p) over p, plus the traction outside contact, against F/A0, over the sum of both signs",
    )


def _at_most(name, value, limit, description, subject):
    """The finding that a value keeps to a limit, or does not."""
    # A value that is not a number keeps to no limit; it is reported as -1, which no error can be.
    value = float(value)
    finite = math.isfinite(value)
    return Check(name, value if finite else -1.0, float(limit), bool(finite and value <= limit), description, subject)


def worst(checks: Iterable[Check]) -> tuple[Check, ...]:
    """One check of every name: a failed one before passed ones, then the one with the largest value."""
    found: dict[str, Check] = {}
    for check in checks:
        best = found.get(check.name)
        if best is None or (not check.passed, check.value) > (not best.passed, best.value):
            found[check.name] = check
    return tuple(found.values())


def told(check: Check) -> str:
    """A failed check in a line."""
    if check.name == COMPLETED:
        return f"{check.subject}: the run failed: {check.description}"
    return f"{check.subject}: {check.name}: {check.value:.3g} ({check.description}); allowed: at most {check.limit:g}"


def refuse_unknown_failures(checks: Iterable[Check], known: Iterable[str]) -> None:
    """Refuse failed checks of other subjects than those that are known to fail.

    Raises
    ------
    ValueError
        Listing the checks that failed and are not known to, and the subjects that are known to fail and do not.
    """
    failed = [check for check in checks if not check.passed]
    known = list(known)
    passing = sorted(set(known) - {check.subject for check in failed})
    lines = [told(check) for check in failed if check.subject not in known]
    lines += [f"{subject}: is said to fail, and all of its checks passed" for subject in passing]
    if lines:
        raise ValueError("\n".join(lines))


def write_checks(checks: Iterable[Check], path: str | os.PathLike) -> None:
    """Write findings to a JSON file."""
    rows = [asdict(check) for check in checks]
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(rows, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def read_checks(path: str | os.PathLike) -> tuple[Check, ...]:
    """Read findings from a JSON file."""
    return tuple(Check(**row) for row in json.loads(Path(path).read_text(encoding="utf-8")))
