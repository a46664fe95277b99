"""Simulate the contact of one surface and one material along a path; the result is an xarray dataset."""

import importlib
import logging
import math
import pathlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.full_contact import full_contact_energy_ratio
from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.checks.run import attributes_of_failure, check_run
from icha.contact.attraction import attraction_on
from icha.contact.model import (
    EVENT_KINDS,
    GAP_BINS,
    JUMP_IN,
    PRESSURE_BINS,
    BeyondModel,
    ContactModel,
    Events,
    NotConverged,
    State,
    events_between,
    gap_bins,
)
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import COMPUTED, file_attributes
from icha.datasets.build import bin_values, build_dataset, concatenate_rows, describe_variables, get_values, stack_rows
from icha.datasets.variables.run import CYCLE, FURTHER, INDENTER, LOOP, OF_MODELS, RUN
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS, Table, is_refused
from icha.half_space.layer import softness_of
from icha.path.energy_balance import Waypoint, summarise_loop
from icha.path.follow import follow
from icha.path.targets import (
    ASPERITY_RANGES,
    BETWEEN,
    CONTACT_RADIUS,
    FORCE,
    INDENTATION,
    LEAST_GAP,
    LEAST_PRESSURE,
    MAX_AREA_FRACTION,
    MAX_REDUCED_PRESSURE,
    MEAN_SEPARATION,
    NOMINAL_PRESSURE,
    RELATIVE_LOAD,
    UNITS,
    WITHOUT_ADHESION,
    Path,
    Target,
    largest_area_fraction,
)
from icha.references.indenter_runs import loop_values, sphere_radius, step_values
from icha.references.limits import doubts, tabor_parameter_of
from icha.support.rules import IntegerRange
from icha.support.usual import IchaWarning, unusual_arguments
from icha.surfaces.moments import height_statistics, slope_anisotropy, spectral_moments
from icha.surfaces.resolution import shortest_wave
from icha.surfaces.shapes import describe_shape
from icha.surfaces.summits import SummitCoverage, locate_summits
from icha.surfaces.surface import Surface, full_contact_pressure

# Largest mean separation of a snapshot, in h_rms. Contact forms at much smaller separations.
_HIGHEST_SNAPSHOT = 20.0
# Contact is concentrated at the edges of a free square if the share of contact in the outermost cells exceeds both the
# first number, and the share of these cells multiplied by the second number.
_EDGE_CONTACT, _EDGE_EXCESS = 0.05, 3.0
# Kind of the snapshot at the largest tension during unloading.
PULL_OFF = "pull_off"
_STICKINESS_PAPER = "L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111 (stickiness)"


_LOGGER = logging.getLogger("icha")


class ConvergenceError(RuntimeError):
    """Error: the path could not be computed to its end, for example because it leaves the range of the model.

    `dataset` contains the targets that were reached; its attribute `incomplete` or `beyond_model` states the reason.
    """

    def __init__(self, message: str, dataset: xr.Dataset):
        """Store the message, and the dataset of the targets that were reached."""
        super().__init__(message)
        self.dataset = dataset

    def __reduce__(self):
        """Return the class and the arguments from which pickle restores the error with its dataset."""
        return type(self), (self.args[0], self.dataset)


def simulate(
    surface: Surface,
    material: Material,
    path: Path,
    *,
    model: str = DEFAULT_MODEL,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
    kept: pathlib.Path | None = None,
) -> xr.Dataset:
    """Simulate the contact of a surface and an elastic half-space along a path; return a dataset of all states.

    Parameters
    ----------
    surface : rough surface, scaled to its final rms slope.
    material : contact modulus, work of adhesion, range of attraction and largest flaw of the interface.
    path : loads, areas or separations to reach; at some of these targets, spots and distributions are stored.
    model : "asperities" or "boundary_elements". Boundary elements are slower, and use the limit of a short range
        of attraction.
    seed : seed of the surface, for the record in the dataset; -1 for a surface without a seed.
    progress : function that is called with a line of text at every target, and in a long path also between targets.
        Default: messages of level INFO of the logger "icha".
    kept : folder of checkpoints (`icha.contact.checkpoints`), only with boundary elements. If a call was interrupted, a
        call with the same arguments resumes from the checkpoints.

    Returns
    -------
    xarray.Dataset with dimensions step, snapshot, gap_bin, pressure_bin and spot; every variable has units and a long
    name. If the path continues after the first loading, every equilibrium is a step, and the dataset has a dimension
    event (jumps, coalescence and splitting of spots). Runs with boundary elements also have dimensions row and column.
    Attributes: `contact_model` names the model. `applicability` states why the model is not applicable, or is empty.
    `failed_checks` lists the checks that the run fails (`icha.checks.run.check_run`), and is absent if all checks pass.

    Warns
    -----
    IchaWarning
        If an argument is unusual, mostly because of a wrong unit. If unloading does not have the state of a snapshot.
        If the model is not applicable, or the run fails
        checks: the numbers of this run must not be used.

    Raises
    ------
    ValueError
        If an argument has the wrong type, the model is unknown, a target is out of range on this surface, the surface
        has no summits, or the model is not available for the surface.
    ConvergenceError
        If an equilibrium is not found, a target cannot be reached, or the path leaves the range of the model. The
        attribute `dataset` of the error contains the targets that were reached.
    """
    if model not in tuple(MODELS):
        raise ValueError(f"model: {model!r} must be one of {', '.join(MODELS)}")
    _check_arguments(surface, material, path, MODELS[model].by_summits)
    if kept is not None and not MODELS[model].resumable:
        raise ValueError(f"kept: the model {model} has no checkpoints; expected None")
    # Only the chosen model is imported, because the fingerprint of a run must not depend on other models.
    solver = importlib.import_module(MODELS[model].module)
    seed = IntegerRange(-1).validate("seed", seed)
    if progress is None and _LOGGER.isEnabledFor(logging.INFO):
        progress = _LOGGER.info
    for text in (*_unusual_arguments(surface, material), *doubts(surface, material, path, model)):
        warnings.warn(text, IchaWarning, stacklevel=2)
    dataset = _compute(solver, surface, material, path, model, seed, progress, kept)
    saved = list(zip(dataset["snapshot_kind"].values, dataset["snapshot_target"].values, strict=True))
    for target in path.unloading_snapshots:
        if (target.snapshot_kind, target.value) not in saved:
            text = f"{target.describe()}: no snapshot, because unloading does not reach this state, or jumps over it"
            warnings.warn(text, IchaWarning, stacklevel=2)
    if dataset.attrs["applicability"]:
        warnings.warn(dataset.attrs["applicability"], IchaWarning, stacklevel=2)
    for name, reasons in attributes_of_failure(check_run(dataset)).items():
        dataset = dataset.assign_attrs({name: reasons})
        invalid = "hysteresis loss" if name == "failed_loss_checks" else "numbers"
        warnings.warn(
            f"The run fails checks; do not use the {invalid} of this run: {reasons}", IchaWarning, stacklevel=2
        )
    return dataset


def _unusual_arguments(surface: Surface, material: Material) -> Iterator[str]:
    """Yield a message for each property of a surface or a material that is outside its usual range."""
    slope = {} if surface.smooth else {"rms_slope": surface.rms_slope}
    shape = vars(surface.shape) if surface.shape else {}
    # Without adhesion, the range of attraction has no effect.
    unused = () if material.surface_energy else ("interaction_range",)
    given = vars(material) | shape | {"period": surface.period} | slope
    return unusual_arguments({name: value for name, value in given.items() if name not in unused})


def _compute(solver, surface, material, path, model, seed, progress, kept):
    """Return the dataset of a run before its checks; raise `ConvergenceError` if the run is incomplete.

    solver : module of the model; all other arguments are those of `simulate`.
    """
    # With one thread, linear algebra adds in a fixed order, so every bit of the result is the same on all machines.
    with threadpool_limits(1):
        contact = solver.contact_of(surface, material)
        observables = contact.observables(surface)
        if kept is not None:
            contact = solver.resumable(contact, kept)
        reachable = path.within_asperity_range() if MODELS[model].by_summits else path
        record = _record_path(contact, observables, path, reachable, progress)
        loading = [step["mean_separation"] for step in record.steps if step["leg"] == 0]
        reasons = observables.reasons_against(loading, record.pressed) + _reasons_of_edges(surface, record.steps)
        values = observables.of_contact()
        dataset = _dataset(surface, material, path, model, seed, record, contact.asperities, reasons, values)
    if record.failure:
        raise ConvergenceError(record.failure, dataset) from None
    if path.unload:
        pull_off = record.snapshots[-1]["snapshot_step"]
        # Nominal tension if all summits had their pull-off force at the same time, Pa.
        radii = float(np.sum(contact.asperities.radius_of_curvature))
        summits_pull = 1.5 * np.pi * material.surface_energy * radii / contact.area
        least_area = 1 / surface.grid**2 if MODELS[model].by_cells else 0.0
        loop = summarise_loop(record.steps, pull_off, material, summits_pull, record.unattributed, least_area)
        loop["uphill_jump_in_count"] = _count_uphill_jumps_in(record)
        measured = loop_values(record.steps, loop, surface, material) if surface.free else {}
        dataset = dataset.assign(describe_variables(LOOP | INDENTER, loop | measured))
    return dataset


def empty_run(
    surface: Surface, material: Material, path: Path, reason: str, *, model: str = DEFAULT_MODEL, seed: int = -1
) -> xr.Dataset:
    """Return the dataset of a run that could not be computed: no steps, and the reason as attribute `incomplete`.

    The arguments other than `reason` are those of `simulate`.
    """
    record, summits = _PathRecord(reason), locate_summits(surface)
    coverage = SummitCoverage.of(surface, summits)
    reasons = coverage.reasons_against([surface.unit_height]) if MODELS[model].by_summits else []
    return _dataset(surface, material, path, model, seed, record, summits, reasons, {})


def _dataset(surface, material, path, name, seed, record, summits, reasons, of_contact):
    """Build the dataset of a run from the record of its path, without the values of pull-off and hysteresis loss.

    name : name of the model.
    summits : summits of the surface.
    reasons : reasons why the model does not represent the surface.
    of_contact : values that are the same in all states.
    """
    table = RUN | FURTHER[name]
    nodes = np.arange(surface.grid) * surface.spacing
    values = {
        **{axis: nodes for axis in ("x", "y") if axis in table},
        **_path_values(table, path, record, surface.grid),
        **_indenter_values(surface, material, record.steps),
        **_surface_values(surface, material, seed),
        **of_contact,
        "asperity_count": len(summits),
        "unsupported_summit_count": len(summits.unsupported_height),
        **bin_values("gap", gap_bins(surface)),
        **bin_values("pressure", PRESSURE_BINS * (material.contact_modulus * surface.unit_slope)),
    }
    dataset = build_dataset(
        table | CYCLE | INDENTER | _describe_targets(table, path), values, _attributes(surface, material, path, name)
    )
    if MODELS[name].by_summits:
        largest = max((step["contact_area_fraction"] for step in record.steps), default=0.0)
        gap = min((step["mean_gap"] for step in record.steps), default=math.inf) / surface.unit_height
        applicability = asperity_applicability(values["full_contact_energy_ratio"], reasons, largest, gap)
    else:
        applicability = f"{MODELS[name].words} not applicable: {'; '.join(reasons)}" if reasons else ""
    dataset.attrs["applicability"] = applicability
    if not record.failure:
        return dataset
    return dataset.assign_attrs({"beyond_model" if record.beyond_model else "incomplete": record.failure})


def _reasons_of_edges(surface: Surface, steps: Sequence[dict]) -> list[str]:
    """Return a reason, as a sentence, if contact is concentrated at the edges of a free square; otherwise []."""
    largest = max((step.get("edge_contact", 0.0) for step in steps), default=0.0)
    share = 1 - (1 - 2 / surface.grid) ** 2
    if largest <= max(_EDGE_CONTACT, _EDGE_EXCESS * share):
        return []
    expected = "use a larger square" if surface.shape else "level the scan, or use a larger scan"
    return [
        f"{largest:.0%} of the contact area is in the outermost cells of the square, which are {share:.1%} of all "
        f"cells: the edges of the square carry the load; {expected}"
    ]


def asperity_applicability(
    full_contact_energy_ratio: float,
    summit_reasons: Sequence[str] = (),
    contact_area_fraction: float = 0.0,
    reduced_gap: float = math.inf,
) -> str:
    """Return the reasons why the asperity model is not applicable, as text; the text is empty if the model applies.

    Parameters
    ----------
    full_contact_energy_ratio : elastic energy of full contact divided by work of adhesion; infinite without adhesion.
    summit_reasons : reasons why the summits do not represent the surface.
    contact_area_fraction : largest contact area fraction A/A0 of the run.
    reduced_gap : smallest mean gap of the run, divided by the rms height.
    """
    reasons, ratio = [], f"U_full/dgamma = {full_contact_energy_ratio:.3g}"
    reasons += summit_reasons
    limit = largest_area_fraction(full_contact_energy_ratio)
    if contact_area_fraction > limit:
        reasons.append(
            f"contact area A/A0 = {contact_area_fraction:.3g}, more than {limit:.3g}: adhesion unites neighbouring "
            f"spots ({ratio})"
        )
    if reduced_gap < LEAST_GAP:
        reasons.append(
            f"mean gap of {reduced_gap:.3g} rms heights, less than {LEAST_GAP:g}: the surfaces overlap beside the spots"
        )
    return f"asperity model not applicable: {'; '.join(reasons)}" if reasons else ""


def _check_arguments(surface, material, path, by_summits):
    """Raise `ValueError` for arguments of the wrong type, and for targets out of range on this surface.

    by_summits : True if summits represent the surface in the model, so that loads and areas are limited.
    """
    for name, value, kind in (("surface", surface, Surface), ("material", material, Material), ("path", path, Path)):
        if not isinstance(value, kind):
            raise ValueError(f"{name}: expected an icha.{kind.__name__}, got a {type(value).__name__}")
    # Loading may end early at the limit of the asperity model, but the first target must be within the limit.
    limited = (path.targets[0], *path.turning_points) if by_summits else ()
    for target in (*path.targets, *path.turning_points, *path.unloading_snapshots):
        if target in limited and target.kind in ASPERITY_RANGES and target.value > 0:
            ASPERITY_RANGES[target.kind].validate(f"path: {target.kind}", target.value)
        _check_target(surface, material, target, by_summits)
        if target.needs_adhesion and not material.surface_energy and (target.value < 0 or target in path.targets):
            raise ValueError(f"path: {target.describe()} {WITHOUT_ADHESION}")


def _check_target(surface, material, target, by_summits):
    """Raise `ValueError` for a load that is too small or too large, a large radius, or a snapshot far above contact."""
    place = f"path: {target.snapshot_kind} = {target.value!r} {UNITS.get(target.kind, '')}".rstrip()
    modulus = material.contact_modulus
    units = {RELATIVE_LOAD: 1.0, NOMINAL_PRESSURE: modulus, FORCE: modulus * surface.period**2}
    if target.kind in units:
        pressure, load = target.value / (units[target.kind] * surface.unit_slope), f"{place} on a surface of rms slope"
        if 0 < abs(pressure) < LEAST_PRESSURE:
            raise ValueError(
                f"{load} {surface.unit_slope:.4g} is too small; expected a reduced pressure of at least "
                f"{LEAST_PRESSURE} in absolute value, or 0 at a turning point that ends unloading"
            )
        if by_summits and pressure > MAX_REDUCED_PRESSURE:
            raise ValueError(
                f"{load} {surface.unit_slope:.4g} is beyond the range of the asperity model; expected a reduced "
                f"pressure of at most {MAX_REDUCED_PRESSURE}"
            )
    largest = (MAX_AREA_FRACTION if by_summits else 1.0) * surface.period**2
    if target.kind == CONTACT_RADIUS and np.pi * target.value**2 > largest:
        expected = f"expected at most {np.sqrt(largest / np.pi):.4g} m"
        model = ", the limit of the asperity model" if by_summits else ""
        raise ValueError(f"{place} is too large on a square of side {surface.period:.4g} m; {expected}{model}")
    separation = {MEAN_SEPARATION: target.value, INDENTATION: -target.value}.get(target.kind, 0.0)
    highest = _HIGHEST_SNAPSHOT * surface.unit_height
    if target.snapshot and separation > highest:
        raise ValueError(
            f"path: a snapshot at a mean separation of {separation!r} m is far above any contact; expected at "
            f"most {_HIGHEST_SNAPSHOT:g} rms heights ({highest:.4g} m)"
        )


@dataclass
class _PathRecord:
    """Values of all steps, snapshots and events of a path, and the reason if the path ends early.

    Attributes
    ----------
    failure : reason why the path ends early; empty for a complete path.
    beyond_model : whether the path ends early because it leaves the range of the model.
    steps, snapshots : for every step and snapshot, a dictionary of values by variable name.
    events : events of every step: jumps in and out of contact, coalescence and splitting of spots.
    unattributed : energy loss that is not attributed to any kind of event, J/m^2.
    pressed : state with the largest contact area during the first loading.
    """

    failure: str = ""
    beyond_model: bool = False
    steps: list[dict] = field(default_factory=list)
    snapshots: list[dict] = field(default_factory=list)
    events: list[Events] = field(default_factory=list)
    unattributed: float = 0.0
    pressed: State | None = None


def _count_uphill_jumps_in(record: _PathRecord) -> int:
    """Count the jumps into contact that cost energy, by the law of a spot or by the energy balance."""
    gained = np.diff([step["dissipated_by_jump_in"] for step in record.steps], prepend=0.0) < 0
    return sum(
        int(np.count_nonzero((events.kind == JUMP_IN) & ((events.energy < 0) | uphill)))
        for events, uphill in zip(record.events, gained, strict=True)
    )


def _record_path(contact, observables, path, reachable, progress) -> _PathRecord:
    """Follow a path and return the record of its steps, snapshots and events.

    reachable : path without targets outside the range of the model; the record ends before the first such target.
    """
    left_out = [target for target in path.targets if target not in reachable.targets]
    remaining = len(reachable.targets)
    record, before, weakest, largest = _PathRecord(), contact.untouched(), None, 0.0
    counts = np.zeros(len(EVENT_KINDS), int)

    def record_snapshot(target, state, step):
        """Add a snapshot of a state to the record; `step` is the index of the step of this state."""
        row = {"snapshot_step": step, "snapshot_kind": target.snapshot_kind, "snapshot_target": target.value}
        record.snapshots.append(_require_finite(row | observables.of_snapshot(state)))

    try:
        for waypoint in follow(contact, reachable, progress):
            state, index = waypoint.state, len(record.steps)
            events = events_between(before, state)
            counts = counts + events.counts()
            numbers = {f"{kind}_count": count for kind, count in zip(EVENT_KINDS, counts, strict=True)}
            step = _step_values(contact, waypoint) | numbers | observables.of_step(state)
            step = _require_finite(step | step_values(step, contact.area))
            record.steps.append(step)
            record.events.append(events)
            record.unattributed = waypoint.balance.unattributed if waypoint.balance else 0.0
            before = state
            if waypoint.leg == 0 and step["contact_area_fraction"] >= largest:
                record.pressed, largest = state, step["contact_area_fraction"]
            if waypoint.target.snapshot:
                record_snapshot(waypoint.target, state, index)
            # Keep the state with the largest tension in the last leg, that is, in the last loading or unloading.
            tension = waypoint.leg, -step["nominal_pressure"]
            if weakest is None or tension > weakest[0]:
                weakest = tension, state, index
            remaining -= waypoint.target in reachable.targets
            if left_out and not remaining:
                raise BeyondModel(f"before {left_out[0].describe()}, which is outside the range of the model")
        if path.unload:
            record_snapshot(Target(PULL_OFF, 0.0), *weakest[1:])
    except NotConverged as error:
        record.failure, record.beyond_model = f"the path ends {error}", isinstance(error, BeyondModel)
    return record


def _require_finite(values: dict) -> dict:
    """Return the values; raise `NotConverged` if a value is neither finite nor of a variable that may be infinite."""
    table = RUN | OF_MODELS | INDENTER
    for name, value in values.items():
        numbers = np.asarray(value)
        if numbers.dtype.kind == "f" and is_refused(numbers, table[name].further if name in table else {}).any():
            raise NotConverged(f"with values of {name} that are not finite")
    return values


def _step_values(contact: ContactModel, waypoint: Waypoint) -> dict:
    """Return those values of an equilibrium that exist in all contact models, by variable name."""
    state, target, balance = waypoint.state, waypoint.target, waypoint.balance
    pressure = contact.pressure(state)
    row = {
        "branch": "loading" if waypoint.loading else "unloading",
        "mean_separation": state.separation,
        "mean_gap": contact.mean_gap(state),
        "nominal_pressure": pressure,
        "contact_area_fraction": contact.area_fraction(state),
        "spot_count": contact.spot_count(state),
        "contact_stiffness": contact.stiffness(state),
        "converged": 1,
        "leg": waypoint.leg,
        "reduced_pressure": pressure / contact.pressure_unit,
        "reduced_separation": state.separation / contact.rms_height,
        "step_kind": target.kind,
        "step_target": target.value,
    }
    if balance is None:
        return row
    kinds = ("jump_in", "jump_off", "coalescence", "load_jump")
    row |= {"work": balance.work, "stored_energy": contact.stored_energy(state)}
    return row | {f"dissipated_by_{kind}": getattr(balance, kind) for kind in kinds}


def _path_values(table: Table, path: Path, record: _PathRecord, grid: int) -> dict:
    """Return the values of all steps, snapshots, spots and events as arrays, by variable name."""
    sizes = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1, "row": grid, "column": grid}
    values = {"control": path.control}
    values |= stack_rows(table, record.steps, "step") | stack_rows(table, record.snapshots, "snapshot", sizes)
    values |= concatenate_rows(table, record.snapshots, "spot", "snapshot")
    if not path.cyclic:
        return values
    counts, events = np.array([len(each) for each in record.events], int), Events.concatenate(record.events)
    return values | {
        **stack_rows(CYCLE, record.steps, "step"),
        "event_kind": events.kind,
        "event_step": np.repeat(np.arange(len(record.steps)), counts),
        "event_separation": np.repeat([step["mean_separation"] for step in record.steps], counts),
        "event_x": events.position[:, 0],
        "event_y": events.position[:, 1],
        "event_members": events.members,
    }


def _indenter_values(surface: Surface, material: Material, steps: Sequence[dict]) -> dict:
    """Return the values of all steps as experiments have them, shape and layer, by variable name; {} if periodic."""
    if not surface.free:
        return {}
    # Models leave out values that they do not have.
    names = [name for name, described in INDENTER.items() if described.dims and (not steps or name in steps[0])]
    values = stack_rows({name: INDENTER[name] for name in names}, steps, "step") if steps else {}
    values["layer_thickness"] = material.thickness
    if surface.shape is not None:
        values["shape"] = describe_shape(surface.shape)
    radius = sphere_radius(surface)
    return values if radius is None else values | {"shape_radius": radius}


def _describe_targets(table: Table, path: Path) -> Table:
    """Return the descriptions of `step_target` and `snapshot_target`; the units depend on the targets of the path."""
    steps = {target.kind for target in (*path.targets, *path.turning_points)} | ({BETWEEN} if path.cyclic else set())
    snapshots = {target.snapshot_kind for target in (*path.targets, *path.unloading_snapshots) if target.snapshot}
    snapshots |= {PULL_OFF} if path.unload else set()
    return {
        "step_target": table["step_target"]._replace(**_target_unit(steps, "step_kind")),
        "snapshot_target": table["snapshot_target"]._replace(**_target_unit(snapshots, "snapshot_kind")),
    }


def _target_unit(kinds: set[str], named_by: str) -> dict:
    """Return the unit of targets of these kinds; if units differ, add a comment that lists the kinds with a unit."""
    units = {UNITS.get(kind, "1") for kind in kinds}
    if len(units) <= 1:
        return {"units": units.pop() if units else "1"}
    parts = [
        f"in {unit} where {named_by} is {' or '.join(sorted(kind for kind in kinds if UNITS.get(kind) == unit))}"
        for unit in sorted(units - {"1"}, reverse=True)
    ]
    return {"units": "1", "further": {"comment": f"{', '.join(parts)}, else 1"}}


def _surface_values(surface: Surface, material: Material, seed: int) -> dict:
    """Return the values of the surface and the material, by variable name."""
    moments, (skewness, kurtosis) = spectral_moments(surface), height_statistics(surface)
    wavelength, estimated = shortest_wave(surface)
    # Pressure in full contact at zero load, for E* = 1. Half its work on the heights is the elastic energy.
    pressure = full_contact_pressure(surface.heights, surface.period, free=surface.free, softness=softness_of(material))
    complete = -float(pressure.min()) * material.contact_modulus
    energy = float(np.vdot(surface.heights, pressure)) / (2 * pressure.size)
    return {
        **get_values(material, *MATERIAL, "flaw_radius"),
        **get_values(surface, *ROUGHNESS, "unit_height", "unit_slope", "period", "boundary", "grid"),
        "seed": seed,
        "short_wavelength": wavelength,
        "short_wavelength_estimated": int(estimated),
        "spectral_moment_0": moments.m0,
        "spectral_moment_2": moments.m2,
        "spectral_moment_4": moments.m4,
        "nayak_parameter": moments.nayak_parameter,
        "tabor_parameter": tabor_parameter_of(surface, material),
        "stickiness": stickiness(moments, material),
        "full_contact_energy_ratio": full_contact_energy_ratio(
            energy, material.contact_modulus, material.surface_energy
        ),
        "complete_contact_pressure": complete,
        "theoretical_strength": material.theoretical_strength,
        "interface_strength": material.interface_strength,
        "full_contact_opening_pressure": complete - material.interface_strength,
        "height_skewness": skewness,
        "height_kurtosis": kurtosis,
        "slope_anisotropy": slope_anisotropy(surface),
    }


def _attributes(surface, material, path, name):
    """Return the global attributes of a run of the model `name`."""
    model = MODELS[name]
    attributes = file_attributes(
        f"Rough contact {'with' if material.surface_energy > 0 else 'without'} adhesion, {model.title}",
        f"{'Loading and unloading' if path.cyclic else 'Loading sweep'} of a "
        f"{'periodic rough surface' if not surface.free else 'single rough square'} against an "
        f"elastic half-space by {model.method}.",
        COMPUTED,
        references=f"{model.references}; {_STICKINESS_PAPER}",
    )
    if model.by_cells:
        attributes["attraction"] = attraction_on(material, surface.spacing)
    # A campaign sets the attributes that are empty here.
    empty = ("campaign", "study", "config_sha256", "program_sha256", "license")
    return attributes | {"contact_model": name} | dict.fromkeys(empty, "")
