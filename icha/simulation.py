"""One sweep of one surface and one material, loading and unloading, as a labelled dataset."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from icha.asperity.jkr import JKR
from icha.asperity.material import Material
from icha.asperity.stickiness import stickiness
from icha.contact.bins import GAP_BINS, PRESSURE_BINS
from icha.contact.events import Events
from icha.contact.failures import NotConverged
from icha.datasets.attributes import COMPUTED, discovery
from icha.datasets.bins import bin_values
from icha.datasets.build import build, described
from icha.datasets.variables.run import CYCLE, LOOP, RUN
from icha.equilibrium.distributions import gap_distribution, pressure_distribution
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.path.limits import MAX_REDUCED_PRESSURE
from icha.path.targets import MEAN_SEPARATION, RELATIVE_LOAD, Path, Target
from icha.support.validation import integer
from icha.surfaces.moments import spectral_moments
from icha.surfaces.summits import find_summits
from icha.surfaces.surface import Surface

# Snapshots farther up, in h_rms, would not fit the bins of the gap.
_HIGHEST_SNAPSHOT = 20.0

# The snapshot of the largest tension on the way back.
PULL_OFF = "pull_off"

# Wu's jump-in formula was verified between these Tabor parameters.
WU_RANGE = (2.0, 5.0)

REFERENCES = (
    "G. Violano and L. Afferrante, Modeling the adhesive contact of rough soft media with an advanced asperity model; "
    "L. Afferrante, G. Carbone and G. Demelio, Wear 278-279 (2012) 28-33, doi:10.1016/j.wear.2011.12.013; "
    "J.-J. Wu, J. Phys. D: Appl. Phys. 43 (2010) 415303; "
    "L. Pastewka and M. O. Robbins, PNAS 111 (2014) 3298-3303, doi:10.1073/pnas.1320846111 (stickiness)"
)


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
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Press a surface against the half-space along a path, and pull it off again if the path does.

    Parameters
    ----------
    surface, material, path : what is pressed against what, and how far.
    seed : recorded in the dataset; -1 for a surface without one.
    progress : called with a line of text at every stop.

    Returns
    -------
    xarray.Dataset with dimensions step, snapshot, gap_bin, pressure_bin and spot; every variable carries units and
    a long name. A path that goes on after the first loading has all its equilibria as steps, and a dimension event.

    Raises
    ------
    ValueError
        If an argument is of the wrong type, a target lies beyond what the model covers on this surface, or the
        surface has no summits.
    ConvergenceError
        If an equilibrium is not found or a target cannot be reached; its `dataset` holds the stops before.
    """
    for name, value, kind in (
        ("surface", surface, Surface),
        ("material", material, Material),
        ("path", path, Path),
    ):
        if not isinstance(value, kind):
            raise ValueError(f"{name}: a {type(value).__name__} is not an icha.{kind.__name__}")
    seed = integer("seed", seed, -1)
    for target in (*path.targets, *path.turning_points):
        if target.kind == RELATIVE_LOAD and target.value > MAX_REDUCED_PRESSURE * surface.rms_slope:
            raise ValueError(
                f"path: {RELATIVE_LOAD} = {target.value!r} on a surface of rms slope {surface.rms_slope:.4g} lies "
                f"beyond what the model covers (a reduced pressure of at most {MAX_REDUCED_PRESSURE})"
            )
        if target.snapshot and target.kind == MEAN_SEPARATION and target.value > _HIGHEST_SNAPSHOT * surface.rms_height:
            raise ValueError(
                f"path: a snapshot at a mean separation of {target.value!r} m lies more than {_HIGHEST_SNAPSHOT:g} rms "
                f"heights ({_HIGHEST_SNAPSHOT * surface.rms_height:.4g} m) up, far above any contact"
            )
    law = JKR(material)
    steps, snapshots, events, failure = [], [], [], None
    pulled = None  # step and state of the largest tension
    # One thread for linear algebra: the order of sums, and with it every bit, is then the same everywhere.
    with threadpool_limits(1):
        contact = InteractingAsperities(law, find_summits(surface), surface.rms_height, path.united_until)
        unit = material.contact_modulus * surface.rms_slope
        try:
            before = None
            for waypoint in follow(contact, path, unit, progress):
                steps.append(_step(contact, waypoint, unit))
                if waypoint.target.snapshot:
                    snapshots.append(_snapshot(law, surface, waypoint.target, waypoint.state, len(steps) - 1))
                if path.cyclic:
                    steps[-1] |= _balance(contact, waypoint)
                    events.append(
                        Events.joined(()) if before is None else contact.events_between(before, waypoint.state)
                    )
                    before = waypoint.state
                if pulled is None or waypoint.leg > pulled[2] or _pressure(steps[-1]) < _pressure(steps[pulled[0]]):
                    pulled = len(steps) - 1, waypoint.state, waypoint.leg
            if path.unload:
                snapshots.append(_snapshot(law, surface, Target(PULL_OFF, 0.0), pulled[1], pulled[0]))
        except NotConverged as error:
            failure = f"the path ends {error}"
        dataset = _dataset(surface, material, contact, steps, snapshots, seed, path, events)
        if failure is None and path.unload:
            dataset = dataset.assign(described(LOOP, _loop(contact, steps, pulled[0])))
    if failure is not None:
        raise ConvergenceError(failure, dataset.assign_attrs(incomplete=failure)) from None
    return dataset


def _pressure(step):
    return step["nominal_pressure"]


def _step(contact, waypoint, unit):
    state, target = waypoint.state, waypoint.target
    spots = state.spots
    pressure = contact.pressure(state)
    single = spots.members == 1
    mu = contact.law.material.tabor_parameter(spots.radius_of_curvature[single])
    outside = np.count_nonzero((mu < WU_RANGE[0]) | (mu > WU_RANGE[1]))
    adhesive = contact.law.material.surface_energy > 0
    return {
        "mean_separation": state.separation,
        "mean_gap": contact.mean_gap(state),
        "nominal_pressure": pressure,
        "contact_area_fraction": contact.area_fraction(state),
        "spot_count": len(spots),
        "contact_stiffness": contact.stiffness(state),
        "residual": state.residual,
        "converged": 1,
        "branch": "loading" if waypoint.loading else "unloading",
        "leg": waypoint.leg,
        "reduced_pressure": pressure / unit,
        "reduced_separation": state.separation / contact.rms_height,
        "step_kind": target.kind,
        "step_target": target.value,
        "jump_in_count": state.jump_ins,
        "jump_off_count": state.jump_offs,
        "coalescence_count": state.coalescences,
        "split_count": state.splits,
        "pending_count": state.pending,
        "outside_wu_fraction": outside / max(len(mu), 1) if adhesive else 0.0,
    }


def _balance(contact, waypoint):
    """Energy at a waypoint of a cyclic path, J/m^2."""
    balance = waypoint.balance
    return {
        "work": balance.work,
        "stored_energy": contact.stored_energy(waypoint.state),
        "dissipated_by_jump_in": balance.jump_in,
        "dissipated_by_jump_off": balance.jump_off,
        "dissipated_by_coalescence": balance.coalescence,
        "dissipated_by_load_jump": balance.load_jump,
    }


def _loop(contact, steps, pulled):
    """What a path from first contact to separation has cost; `pulled` is the step of its largest tension."""
    material, last = contact.law.material, steps[-1]
    adhesive = material.surface_energy > 0
    touching = max((k for k, step in enumerate(steps) if step["spot_count"]), default=0)
    tension = max(0.0, -_pressure(steps[pulled]))
    # Nothing is stored at either end.
    loss = last["work"]
    losses = {
        name: last[f"dissipated_{name}"] for name in ("by_jump_in", "by_jump_off", "by_coalescence", "by_load_jump")
    }
    summits = (
        1.5 * np.pi * material.surface_energy * float(np.sum(contact.asperities.radius_of_curvature)) / contact.area
    )
    strength = 16 / (9 * np.sqrt(3)) * material.surface_energy / material.interaction_range
    return {
        "pull_off_pressure": tension,
        "pull_off_separation": steps[pulled]["mean_separation"],
        "pull_off_over_strength": tension / strength if adhesive else 0.0,
        "pull_off_over_summits": tension / summits if adhesive else 0.0,
        "detachment_pressure": _pressure(steps[touching]),
        "detachment_separation": steps[touching]["mean_separation"],
        "hysteresis_loss": loss,
        "hysteresis_loss_over_surface_energy": loss / material.surface_energy if adhesive else 0.0,
        **{f"loss_{name}": value for name, value in losses.items()},
        "loss_unattributed": loss - sum(losses.values()),
        "largest_contact_area_fraction": max(step["contact_area_fraction"] for step in steps),
        "largest_reduced_pressure": max(step["reduced_pressure"] for step in steps),
    }


def _snapshot(law, surface, target, state, step):
    spots = state.spots
    gaps = gap_distribution(law, surface, state)
    pressures = pressure_distribution(law, surface, spots)
    return {
        "snapshot_step": step,
        "snapshot_kind": target.kind,
        "snapshot_target": target.value,
        "overlap_fraction": gaps.overlap_fraction,
        "area_beyond_edges": gaps.beyond_edges,
        "gap_density": gaps.density,
        "pressure_density": pressures.density,
        "pressure_bin_mean": pressures.mean,
        "spot_x": spots.position[:, 0],
        "spot_y": spots.position[:, 1],
        "spot_radius": spots.contact_radius,
        "spot_force": law.force(spots.contact_radius, spots.radius_of_curvature),
        "spot_curvature_radius": spots.radius_of_curvature,
        "spot_members": spots.members,
    }


def _event_columns(steps, events):
    """The events of all steps, one after the other."""
    counts = [len(each) for each in events]
    joined = Events.joined(events)
    return {
        "event_kind": joined.kind,
        "event_step": np.repeat(np.arange(len(steps)), counts),
        "event_separation": np.repeat([step["mean_separation"] for step in steps], counts),
        "event_x": joined.position[:, 0],
        "event_y": joined.position[:, 1],
        "event_members": joined.members,
    }


def _snapshot_columns(snapshots):
    """What belongs to snapshots, and the spots of all, one after the other."""
    counts = [len(snapshot["spot_x"]) for snapshot in snapshots]
    sizes = {"snapshot": len(snapshots), "gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1}
    columns = {"spot_snapshot": np.repeat(np.arange(len(snapshots)), counts)}
    for name, (dims, *_) in RUN.items():
        if dims == ("spot",) and name != "spot_snapshot":
            columns[name] = np.concatenate([np.empty(0), *(snapshot[name] for snapshot in snapshots)])
        elif dims[:1] == ("snapshot",) and name != "snapshot":
            rows = np.array([snapshot[name] for snapshot in snapshots])
            columns[name] = rows.reshape([sizes[dim] for dim in dims])
    return columns


def _dataset(surface, material, contact, steps, snapshots, seed, path, events):
    radius_of_curvature = 1 / surface.rms_curvature
    moments = spectral_moments(surface)
    values = {
        **bin_values("gap", GAP_BINS * surface.rms_height),
        **bin_values("pressure", PRESSURE_BINS * (material.contact_modulus * surface.rms_slope)),
        "contact_modulus": material.contact_modulus,
        "surface_energy": material.surface_energy,
        "interaction_range": material.interaction_range,
        "rms_slope": surface.rms_slope,
        "rms_height": surface.rms_height,
        "rms_curvature": surface.rms_curvature,
        "spectral_moment_0": moments.m0,
        "spectral_moment_2": moments.m2,
        "spectral_moment_4": moments.m4,
        "nayak_parameter": moments.nayak_parameter,
        "period": surface.period,
        "boundary": surface.boundary,
        "grid": surface.grid,
        "seed": seed,
        "tabor_parameter": float(material.tabor_parameter(radius_of_curvature)),
        "stickiness": stickiness(moments, material),
        "asperity_count": len(contact.asperities),
        "control": path.control,
        "united_until": path.united_until,
    }
    values["step"], values["snapshot"] = np.arange(len(steps)), np.arange(len(snapshots))
    values |= {name: [step[name] for step in steps] for name in RUN if RUN[name].dims == ("step",) and name != "step"}
    if path.cyclic:
        of_steps = [name for name in CYCLE if CYCLE[name].dims == ("step",)]
        values |= {name: [step[name] for step in steps] for name in of_steps} | _event_columns(steps, events)
    values |= _snapshot_columns(snapshots)
    adhesion = "with" if material.surface_energy > 0 else "without"
    attrs = discovery(
        f"Rough contact {adhesion} adhesion, ICHA model",
        f"{'Loading and unloading' if path.cyclic else 'Loading sweep'} of a "
        f"{'periodic rough surface' if not surface.free else 'single rough square'} against an "
        "elastic half-space by interacting and coalescing asperities with JKR adhesion and jump into contact.",
        COMPUTED,
        references=REFERENCES,
    )
    of_campaign = dict.fromkeys(("campaign", "study", "config_sha256", "license"), "")
    return build(RUN | CYCLE, values, attrs | of_campaign)
