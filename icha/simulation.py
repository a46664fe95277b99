"""One sweep of one surface and one material, loading and unloading, as a labelled dataset."""

import importlib
import pathlib
import warnings
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.full_contact import FULL_CONTACT_BELOW, full_contact_energy_ratio
from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.checks.run import check_run, reasons_of_failure
from icha.contact.model import (
    GAP_BINS,
    JUMP_IN,
    PRESSURE_BINS,
    ContactModel,
    Events,
    NotConverged,
    State,
    count_summits,
    gap_bins,
)
from icha.contact.models import DEFAULT_MODEL, MODELS
from icha.datasets.attributes import COMPUTED, file_attributes
from icha.datasets.build import bin_values, build_dataset, concatenate_rows, describe_variables, get_values, stack_rows
from icha.datasets.variables.run import CYCLE, FURTHER, LOOP, RUN
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS, Table
from icha.path.energy_balance import Waypoint, summarise_loop
from icha.path.follow import follow
from icha.path.targets import (
    BETWEEN,
    IN_METRES,
    LEAST_PRESSURE,
    MAX_AREA_FRACTION,
    MAX_REDUCED_PRESSURE,
    MEAN_SEPARATION,
    RELATIVE_LOAD,
    Path,
    Target,
)
from icha.support.rules import IntegerRange
from icha.surfaces.moments import height_statistics, slope_anisotropy, spectral_moments
from icha.surfaces.summits import SummitCoverage, locate_summits
from icha.surfaces.surface import Surface

# Relative excess of a contact area over its limit that is within the tolerance of the equilibria.
_AREA_TOLERANCE = 1e-6
# Snapshots farther up, in h_rms, are far above any contact.
_HIGHEST_SNAPSHOT = 20.0

# The snapshot of the largest tension on the way back.
PULL_OFF = "pull_off"

_OF_STICKINESS = "L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111 (stickiness)"


class ConvergenceError(RuntimeError):
    """The path could not be followed to its end.

    `dataset` holds the stops that were reached, and the reason in its attribute `incomplete`.
    """

    def __init__(self, message: str, dataset: xr.Dataset):
        """Keep the message and what was computed."""
        super().__init__(message)
        self.dataset = dataset

    def __reduce__(self):
        """Allow the error to cross process borders whole."""
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
    """Press a surface against the half-space along a path, and pull it off again if the path does.

    Parameters
    ----------
    surface : the topography, at the rms slope at which it is pressed.
    material : modulus, energy and range of the interface.
    path : the loads, areas or separations that are reached, in what order, and which of them keep their spots.
    model : "asperities", or "boundary_elements" in the limit of a short range of attraction, which is slower and needs
        a periodic surface.
    seed : recorded in the dataset; -1 for a surface without one.
    progress : called with a line of text at every stop.
    kept : a folder in which equilibria are kept as they are found, and in which those are that a call with the same
        arguments found before it was stopped (`icha.contact.checkpoints`); of boundary elements.

    Returns
    -------
    xarray.Dataset with dimensions step, snapshot, gap_bin, pressure_bin and spot; every variable carries units and
    a long name. A path that goes on after the first loading has all its equilibria as steps, and a dimension event. The
    attribute `contact_model` names the model, and `applicability` says why it is not applicable to this contact, or is
    empty; boundary elements have dimensions row and column, besides. If the run fails checks
    (`icha.checks.run.check_run`), the attribute `failed_checks` says which, and by how much.

    Warns
    -----
    UserWarning
        If the run fails checks: its numbers are no results.

    Raises
    ------
    ValueError
        If an argument is of the wrong type, there is no such model, a target lies beyond what is allowed on this
        surface, or the surface has no summits or cannot be computed by the model.
    ConvergenceError
        If an equilibrium is not found or a target cannot be reached; its `dataset` holds the stops before.
    """
    _check_arguments(surface, material, path)
    solver = _solver(model)
    if kept is not None and not MODELS[model].resumable:
        raise ValueError(f"kept: equilibria of the model {model} cannot be kept; allowed: None")
    seed = IntegerRange(-1).validate("seed", seed)
    dataset = _computed(solver, surface, material, path, model, seed, progress, kept)
    if failed := reasons_of_failure(check_run(dataset)):
        dataset = dataset.assign_attrs(failed_checks=failed)
        warnings.warn(f"The run fails checks, do not use its numbers: {failed}", stacklevel=2)
    return dataset


def _computed(solver, surface, material, path, model, seed, progress, kept):
    """The dataset of a run, unchecked; raises `ConvergenceError` with what there is of it."""
    # One thread for linear algebra: the order of sums, and with it every bit, is then the same everywhere.
    with threadpool_limits(1):
        contact = solver.contact_of(surface, material)
        observables = contact.observables(surface)
        if kept is not None:
            contact = solver.resumable(contact, kept)
        met = _followed(contact, observables, path, progress)
        loading = [step["mean_separation"] for step in met.steps if step["leg"] == 0]
        reasons = observables.reasons_against(loading, met.pressed)
        dataset = _dataset(surface, material, path, model, seed, met, observables.of_contact(), reasons)
    if met.failure:
        raise ConvergenceError(met.failure, dataset) from None
    if path.unload:
        pull_off = met.snapshots[-1]["snapshot_step"]
        loop = summarise_loop(met.steps, pull_off, material, observables.largest_tension, met.unattributed)
        dataset = dataset.assign(describe_variables(LOOP, loop | {"uphill_jump_in_count": _count_uphill_jumps_in(met)}))
    return dataset


def unfollowed(
    surface: Surface, material: Material, path: Path, reason: str, *, model: str = DEFAULT_MODEL, seed: int = -1
) -> xr.Dataset:
    """The dataset of a run of which nothing can be computed: no step, and the reason in the attribute `incomplete`.

    Arguments are those of `simulate`.
    """
    met, summits = _Met([], [], [], reason), locate_summits(surface)
    coverage = SummitCoverage.of(surface, summits)
    reasons = coverage.reasons_against([surface.rms_height]) if MODELS[model].by_summits else []
    return _dataset(surface, material, path, model, seed, met, count_summits(summits), reasons)


def _dataset(surface, material, path, name, seed, met, of_contact, reasons=()):
    """All of a run but the loop as a whole; with the reason why it ends early, if it does."""
    table = RUN | FURTHER[name]
    values = {
        **_of_path(table, path, met, surface.grid),
        **_of_surface(surface, material, seed),
        **of_contact,
        **bin_values("gap", gap_bins(surface)),
        **bin_values("pressure", PRESSURE_BINS * (material.contact_modulus * surface.rms_slope)),
    }
    described_here = table | CYCLE | _targets(table, path)
    dataset = build_dataset(described_here, values, _attributes(surface, material, path, name))
    dataset.attrs["applicability"] = _applicability(name, values, met, reasons)
    return dataset.assign_attrs(incomplete=met.failure) if met.failure else dataset


def _applicability(name, values, met, reasons):
    """Why the model is not applicable to the run; an empty text where it is."""
    if not MODELS[name].by_summits:
        return f"{MODELS[name].words} not applicable: {'; '.join(reasons)}" if reasons else ""
    largest = max((step["contact_area_fraction"] for step in met.steps), default=0.0)
    return asperity_applicability(values["full_contact_energy_ratio"], reasons, largest)


def asperity_applicability(
    full_contact_energy_ratio: float, summit_reasons: Sequence[str] = (), contact_area_fraction: float = 0.0
) -> str:
    """Return why the asperity model is not applicable; an empty text where it is.

    Parameters
    ----------
    full_contact_energy_ratio : elastic energy of full contact over the work of adhesion; infinite without adhesion.
    summit_reasons : reasons that lie in the summits of the surface.
    contact_area_fraction : largest A/A0 of the run.
    """
    reasons = []
    if full_contact_energy_ratio < FULL_CONTACT_BELOW:
        reasons.append(
            f"full contact has the lower energy (U_full/dgamma = {full_contact_energy_ratio:.3g}, less than "
            f"{FULL_CONTACT_BELOW:g})"
        )
    reasons += summit_reasons
    if contact_area_fraction > MAX_AREA_FRACTION * (1 + _AREA_TOLERANCE):
        reasons.append(f"contact area A/A0 = {contact_area_fraction:.3g}, beyond {MAX_AREA_FRACTION:g}")
    return f"asperity model not applicable: {'; '.join(reasons)}" if reasons else ""


def _solver(name: str) -> ModuleType:
    """The module that makes the contact. Only this one is imported: what another is made of does not concern a run."""
    if name not in tuple(MODELS):
        raise ValueError(f"model: {name!r} must be one of {', '.join(MODELS)}")
    return importlib.import_module(MODELS[name].module)


def _check_arguments(surface, material, path):
    for name, value, kind in (
        ("surface", surface, Surface),
        ("material", material, Material),
        ("path", path, Path),
    ):
        if not isinstance(value, kind):
            raise ValueError(f"{name}: a {type(value).__name__} is not an icha.{kind.__name__}")
    for target in (*path.targets, *path.turning_points):
        if target.kind == RELATIVE_LOAD:
            asked = f"path: {RELATIVE_LOAD} = {target.value!r} on a surface of rms slope {surface.rms_slope:.4g}"
            if target.value > MAX_REDUCED_PRESSURE * surface.rms_slope:
                raise ValueError(
                    f"{asked} is beyond the range of the asperity model, which limits all models; expected a reduced "
                    f"pressure of at most {MAX_REDUCED_PRESSURE}"
                )
            if 0 < abs(target.value) < LEAST_PRESSURE * surface.rms_slope:
                raise ValueError(
                    f"{asked} is next to no load; allowed: a reduced pressure of at least {LEAST_PRESSURE} in absolute "
                    "value, or 0 at a turning point that ends unloading"
                )
        if target.snapshot and target.kind == MEAN_SEPARATION and target.value > _HIGHEST_SNAPSHOT * surface.rms_height:
            raise ValueError(
                f"path: a snapshot at a mean separation of {target.value!r} m lies more than {_HIGHEST_SNAPSHOT:g} rms "
                f"heights ({_HIGHEST_SNAPSHOT * surface.rms_height:.4g} m) up, far above any contact"
            )


class _Met(NamedTuple):
    """What a path has met: a row of values for every step and snapshot, the events of every step, why it ends early.

    unattributed: loss that is in no class, J/m^2. pressed: state of the first loading with the largest contact area.
    """

    steps: list[dict]
    snapshots: list[dict]
    events: list[Events]
    failure: str
    unattributed: float = 0.0
    pressed: State | None = None


def _count_uphill_jumps_in(met: _Met) -> int:
    """Number of jumps into contact that take energy, by the law of the spot or, with all spots, by the balance."""
    gained = np.diff([step["dissipated_by_jump_in"] for step in met.steps], prepend=0.0) < 0
    return sum(
        int(np.count_nonzero((events.kind == JUMP_IN) & ((events.energy < 0) | uphill)))
        for events, uphill in zip(met.events, gained, strict=True)
    )


def _followed(contact, observables, path, progress) -> _Met:
    steps, snapshots, events, failure = [], [], [], ""
    before = pulled = balance = pressed = None
    largest = 0.0

    def keep_snapshot(target, state, step):
        asked = {"snapshot_step": step, "snapshot_kind": target.kind, "snapshot_target": target.value}
        snapshots.append(_finite(asked | observables.of_snapshot(state)))

    try:
        for waypoint in follow(contact, path, progress):
            state, balance = waypoint.state, waypoint.balance
            steps.append(_finite(_step(contact, waypoint) | observables.of_step(state)))
            events.append(Events.concatenate(()) if before is None else contact.events_between(before, state))
            before = state
            if waypoint.leg == 0 and steps[-1]["contact_area_fraction"] >= largest:
                pressed, largest = state, steps[-1]["contact_area_fraction"]
            if waypoint.target.snapshot:
                keep_snapshot(waypoint.target, state, len(steps) - 1)
            # The largest tension of the last leg.
            tension = waypoint.leg, -steps[-1]["nominal_pressure"]
            if pulled is None or tension > pulled[0]:
                pulled = tension, state, len(steps) - 1
        if path.unload:
            keep_snapshot(Target(PULL_OFF, 0.0), *pulled[1:])
    except NotConverged as error:
        failure = f"the path ends {error}"
    return _Met(steps, snapshots, events, failure, balance.unattributed if balance else 0.0, pressed)


def _finite(values: dict) -> dict:
    """The values of an equilibrium, all of which are finite: one that has others is none."""
    for name, value in values.items():
        numbers = np.asarray(value)
        if numbers.dtype.kind == "f" and not np.isfinite(numbers).all():
            raise NotConverged(f"with values of {name} that are not finite")
    return values


def _step(contact: ContactModel, waypoint: Waypoint) -> dict:
    """What every contact model has of an equilibrium on a path, by the names of the variables."""
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
    return row | {
        "work": balance.work,
        "stored_energy": contact.stored_energy(state),
        "dissipated_by_jump_in": balance.jump_in,
        "dissipated_by_jump_off": balance.jump_off,
        "dissipated_by_coalescence": balance.coalescence,
        "dissipated_by_load_jump": balance.load_jump,
    }


def _of_path(table: Table, path: Path, met: _Met, grid: int) -> dict:
    """The path, and what was met on it: rows as arrays, spots and events one after the other."""
    sizes = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1, "row": grid, "column": grid}
    values = {"control": path.control}
    values |= stack_rows(table, met.steps, "step") | stack_rows(table, met.snapshots, "snapshot", sizes)
    values |= concatenate_rows(table, met.snapshots, "spot", "snapshot")
    if not path.cyclic:
        return values
    counts, events = np.array([len(each) for each in met.events], int), Events.concatenate(met.events)
    return values | {
        **stack_rows(CYCLE, met.steps, "step"),
        "event_kind": events.kind,
        "event_step": np.repeat(np.arange(len(met.steps)), counts),
        "event_separation": np.repeat([step["mean_separation"] for step in met.steps], counts),
        "event_x": events.position[:, 0],
        "event_y": events.position[:, 1],
        "event_members": events.members,
    }


def _targets(table: Table, path: Path) -> Table:
    """Descriptions of the values asked for, with the unit that they have on this path."""
    steps = {target.kind for target in (*path.targets, *path.turning_points)} | ({BETWEEN} if path.cyclic else set())
    snapshots = {target.kind for target in path.targets if target.snapshot} | ({PULL_OFF} if path.unload else set())
    return {
        "step_target": table["step_target"]._replace(**_unit_of(steps, "step_kind")),
        "snapshot_target": table["snapshot_target"]._replace(**_unit_of(snapshots, "snapshot_kind")),
    }


def _unit_of(kinds: set[str], named_by: str) -> dict:
    """Unit of values of these kinds; where they have different ones, a comment says which is whose."""
    metres = kinds.intersection(IN_METRES)
    if not metres or metres == kinds:
        return {"units": "m" if metres else "1"}
    return {"units": "1", "further": {"comment": f"in m where {named_by} is {' or '.join(sorted(metres))}, else 1"}}


def _of_surface(surface: Surface, material: Material, seed: int) -> dict:
    """What is pressed against what."""
    moments, (skewness, kurtosis) = spectral_moments(surface), height_statistics(surface)
    return {
        **get_values(material, *MATERIAL),
        **get_values(surface, *ROUGHNESS, "period", "boundary", "grid"),
        "seed": seed,
        "spectral_moment_0": moments.m0,
        "spectral_moment_2": moments.m2,
        "spectral_moment_4": moments.m4,
        "nayak_parameter": moments.nayak_parameter,
        "tabor_parameter": material.tabor_parameter(1 / surface.rms_curvature),
        "stickiness": stickiness(moments, material),
        "full_contact_energy_ratio": full_contact_energy_ratio(
            surface.full_contact_energy, material.contact_modulus, material.surface_energy
        ),
        "height_skewness": skewness,
        "height_kurtosis": kurtosis,
        "slope_anisotropy": slope_anisotropy(surface),
    }


def _attributes(surface, material, path, name):
    model = MODELS[name]
    attributes = file_attributes(
        f"Rough contact {'with' if material.surface_energy > 0 else 'without'} adhesion, {model.title}",
        f"{'Loading and unloading' if path.cyclic else 'Loading sweep'} of a "
        f"{'periodic rough surface' if not surface.free else 'single rough square'} against an "
        f"elastic half-space by {model.method}.",
        COMPUTED,
        references=f"{model.references}; {_OF_STICKINESS}",
    )
    # Those of a run of a campaign are filled in by the campaign.
    return attributes | {"contact_model": name} | dict.fromkeys(("campaign", "study", "config_sha256", "license"), "")
