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
from icha.contact.events import EVENT_KINDS, Events
from icha.contact.failures import NotConverged
from icha.datasets.attributes import COMPUTED, discovery
from icha.datasets.bins import bin_table, bin_values, with_bounds
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

# name: (dimensions, units, long name)
VARIABLES = {
    "mean_separation": (
        ("step",),
        "m",
        "mean separation of the surfaces; of a free square that of its mean plane and the half-space far away",
    ),
    "mean_gap": (
        ("step",),
        "m",
        "mean gap over the nominal area; of a periodic surface the mean separation, of a free square less or more by "
        "what the half-space is displaced there",
    ),
    "nominal_pressure": (("step",), "Pa", "force over nominal area"),
    "contact_area_fraction": (("step",), "1", "real over nominal contact area, A/A0"),
    "spot_count": (("step",), "1", "number of contact spots"),
    "contact_stiffness": (("step",), "Pa m^-1", "contact stiffness, -dp/du of the present spots"),
    "residual": (("step",), "1", "largest equilibrium error over h_rms"),
    "converged": (("step",), "1", "1 where the equilibrium converged"),
    "leg": (("step",), "1", "leg of the path: 0 the first loading, odd unloading, even loading again"),
    "reduced_pressure": (("step",), "1", "nominal pressure over contact modulus and rms slope, p/(E* h'rms)"),
    "reduced_separation": (("step",), "1", "mean separation over rms height"),
    "step_kind": (("step",), "1", "quantity that this step was asked to reach"),
    "step_target": (
        ("step",),
        "1",
        "value asked for, in the SI unit of its kind (m for mean_separation, else 1)",
    ),
    "jump_in_count": (("step",), "1", "contacts formed so far"),
    "jump_off_count": (("step",), "1", "contacts broken so far"),
    "coalescence_count": (("step",), "1", "unions of two spots so far"),
    "split_count": (
        ("step",),
        "1",
        "united spots so far that let go and left asperities in contact",
    ),
    "pending_count": (
        ("step",),
        "1",
        "asperities past jump-in left free after breaking contact at the same step",
    ),
    "outside_wu_fraction": (("step",), "1", "fraction of single-asperity spots outside 2 <= mu <= 5"),
    "snapshot_step": (("snapshot",), "1", "step of the snapshot"),
    "snapshot_kind": (("snapshot",), "1", "quantity that the snapshot was asked to reach"),
    "snapshot_target": (("snapshot",), "1", "value asked for, in the SI unit of its kind"),
    "overlap_fraction": (
        ("snapshot",),
        "1",
        "area fraction outside the spots where the computed gap is negative",
    ),
    "area_beyond_edges": (
        ("snapshot",),
        "1",
        "part of the nominal area by which spots reach over the edges of a free square; 0 of a periodic surface",
    ),
    "gap_density": (("snapshot", "gap_bin"), "m^-1", "probability density of the gap over the nominal area"),
    "pressure_density": (
        ("snapshot", "pressure_bin"),
        "Pa^-1",
        "probability density of the contact pressure over the nominal area",
    ),
    "pressure_bin_mean": (
        ("snapshot", "pressure_bin"),
        "Pa",
        "mean pressure of the area in the bin, 0 where empty",
    ),
    **bin_table("gap", "m"),
    **bin_table("pressure", "Pa"),
    "spot_snapshot": (("spot",), "1", "snapshot to which the spot belongs"),
    "spot_x": (("spot",), "m", "x of the spot's centre"),
    "spot_y": (("spot",), "m", "y of the spot's centre"),
    "spot_radius": (("spot",), "m", "contact radius"),
    "spot_force": (("spot",), "N", "contact force, negative in tension"),
    "spot_curvature_radius": (("spot",), "m", "radius of curvature of the spot's paraboloid"),
    "spot_members": (("spot",), "1", "number of asperities united in the spot"),
    "contact_modulus": ((), "Pa", "composite contact modulus E*"),
    "surface_energy": ((), "J m^-2", "energy of adhesion per area"),
    "interaction_range": ((), "m", "range of the attractive forces"),
    "rms_slope": ((), "1", "root mean square slope |grad h| from the spectrum"),
    "rms_height": ((), "m", "root mean square height"),
    "rms_curvature": ((), "m^-1", "root mean square curvature of a profile, from the spectrum"),
    "spectral_moment_0": ((), "m^2", "spectral moment m0 of a profile: variance of its height"),
    "spectral_moment_2": ((), "1", "spectral moment m2 of a profile: variance of its slope"),
    "spectral_moment_4": ((), "m^-2", "spectral moment m4 of a profile: variance of its curvature"),
    "nayak_parameter": ((), "1", "Nayak's parameter m0 m4/m2^2: breadth of the spectrum"),
    "period": ((), "m", "side of the periodic cell, or of the free square"),
    "boundary": ((), "1", "what lies beyond the cell: periodic or free"),
    "grid": ((), "1", "nodes along a side of the cell"),
    "seed": ((), "1", "seed of the surface; -1 where it has none"),
    "tabor_parameter": ((), "1", "Tabor parameter with the radius 1/rms_curvature"),
    "stickiness": ((), "1", "attraction over repulsion after Pastewka and Robbins; above 1 surfaces stick"),
    "asperity_count": ((), "1", "number of asperities on the surface"),
    "control": ((), "1", "what is imposed: separation or load"),
    "united_until": ((), "1", "until when united spots stay united on the way back: detachment or overlap"),
}

# Those of a path that goes on after the first loading ...
CYCLE_VARIABLES = {
    "work": (
        ("step",),
        "J m^-2",
        "work done on the contact since first contact, -(integral of p du), "
        "cubic between steps, by pressure and contact stiffness, and at constant pressure in a jump under load control",
    ),
    "stored_energy": (("step",), "J m^-2", "elastic energy less that of adhesion, 0 out of contact"),
    "dissipated_by_jump_in": (("step",), "J m^-2", "energy lost so far as contacts formed"),
    "dissipated_by_jump_off": (("step",), "J m^-2", "energy lost so far as contacts broke"),
    "dissipated_by_coalescence": (("step",), "J m^-2", "energy lost so far as spots united or unions were undone"),
    "dissipated_by_load_jump": (
        ("step",),
        "J m^-2",
        "energy lost so far in jumps at constant load, under load control",
    ),
    "event_kind": (("event",), "1", "kind of the event"),
    "event_step": (("event",), "1", "step at which the event is first seen"),
    "event_separation": (("event",), "m", "mean separation of that step"),
    "event_x": (("event",), "m", "x of the centre of the spot concerned"),
    "event_y": (("event",), "m", "y of the centre of the spot concerned"),
    "event_members": (("event",), "1", "number of asperities in the spot concerned"),
}
# ... and of one that ends in separation.
LOOP_VARIABLES = {
    "pull_off_pressure": ((), "Pa", "largest tension on the last unloading"),
    "pull_off_separation": ((), "m", "mean separation at the largest tension"),
    "pull_off_over_strength": (
        (),
        "1",
        "largest tension over the strength of the interface, 16 dgamma/(9 sqrt(3) range); 0 without adhesion",
    ),
    "pull_off_over_summits": (
        (),
        "1",
        "largest tension over that of all asperities pulling their most at once, 3/2 pi dgamma sum(R)/A0; "
        "0 without adhesion",
    ),
    "detachment_pressure": ((), "Pa", "nominal pressure just before the last contact breaks"),
    "detachment_separation": ((), "m", "mean separation just before the last contact breaks"),
    "hysteresis_loss": ((), "J m^-2", "work lost from first contact to separation, integral of p du around the path"),
    "hysteresis_loss_over_surface_energy": (
        (),
        "1",
        "work lost over the energy of adhesion; 0 without adhesion",
    ),
    "loss_by_jump_in": ((), "J m^-2", "part of the loss in jumps into contact"),
    "loss_by_jump_off": ((), "J m^-2", "part of the loss in jumps out of contact"),
    "loss_by_coalescence": ((), "J m^-2", "part of the loss in unions of spots and their undoing"),
    "loss_by_load_jump": ((), "J m^-2", "part of the loss in jumps at constant load, under load control"),
    "loss_unattributed": (
        (),
        "J m^-2",
        "part of the loss without an event: non-reciprocal interaction and integration",
    ),
    "largest_contact_area_fraction": ((), "1", "largest A/A0 on the path"),
    "largest_reduced_pressure": ((), "1", "largest reduced pressure on the path"),
}


# Spots and events are kept one after the other, and these say to which snapshot or step each belongs: the indexed
# ragged arrays of CF 1.11, section 9.3.4. Its feature types, all of a time or a place on earth, are not claimed.
INDEXED = {"spot_snapshot": "snapshot", "event_step": "step"}
_RAGGED = "index of a ragged array: positions along instance_dimension, from 0"


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
            dataset = dataset.assign(_described(LOOP_VARIABLES, _loop(contact, steps, pulled[0])))
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
        "converged": np.int8(1),
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


_INTEGERS = {
    "leg",
    "split_count",
    "event_step",
    "event_members",
    "spot_count",
    "jump_in_count",
    "jump_off_count",
    "coalescence_count",
    "pending_count",
    "snapshot_step",
    "spot_snapshot",
    "spot_members",
}
_STRINGS = {"step_kind", "snapshot_kind"}


def _dtype(name):
    if name in _STRINGS:
        return object
    if name in ("converged", "event_kind"):
        return np.int8
    return np.int64 if name in _INTEGERS else np.float64


def _described(variables, values):
    """Variables of a dataset with their dimensions, units and long names."""
    return {
        name: (dims, values[name], {"units": units, "long_name": long_name})
        for name, (dims, units, long_name) in variables.items()
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
    wanted = VARIABLES | (CYCLE_VARIABLES if path.cyclic else {})
    if path.cyclic:
        values |= _event_columns(steps, events)
    bins = {"gap_bin": len(GAP_BINS) - 1, "pressure_bin": len(PRESSURE_BINS) - 1}
    for name, (dims, _, _) in wanted.items():
        if name in values:
            if dims == ("event",):
                values[name] = np.asarray(values[name], _dtype(name))
            continue
        if dims == ("spot",):
            rows = [
                np.full(len(s["spot_x"]), k) if name == "spot_snapshot" else s[name] for k, s in enumerate(snapshots)
            ]
            values[name] = np.concatenate(rows).astype(_dtype(name)) if rows else np.empty(0, _dtype(name))
            continue
        rows = [row[name] for row in (steps if dims[0] == "step" else snapshots)]
        shape = (len(rows), *(bins[d] for d in dims[1:]))
        values[name] = np.array(rows, dtype=_dtype(name)).reshape(shape)
    variables = _described(wanted, values)
    if path.cyclic:
        kinds = {"flag_values": np.arange(len(EVENT_KINDS), dtype=np.int8), "flag_meanings": " ".join(EVENT_KINDS)}
        variables["event_kind"][2].update(kinds)
    for name, dim in INDEXED.items():
        if name in variables:
            variables[name][2].update(instance_dimension=dim, comment=_RAGGED)
    adhesion = "with" if material.surface_energy > 0 else "without"
    coordinates = {
        "step": ("step", np.arange(len(steps)), {"units": "1", "long_name": "equilibrium along the path"}),
        "branch": (
            "step",
            np.array([step["branch"] for step in steps], dtype=object),
            {"units": "1", "long_name": "branch of the path: loading or unloading"},
        ),
        "snapshot": ("snapshot", np.arange(len(snapshots)), {"units": "1", "long_name": "snapshot"}),
    }
    attrs = discovery(
        f"Rough contact {adhesion} adhesion, ICHA model",
        f"{'Loading and unloading' if path.cyclic else 'Loading sweep'} of a "
        f"{'periodic rough surface' if not surface.free else 'single rough square'} against an "
        "elastic half-space by interacting and coalescing asperities with JKR adhesion and jump into contact.",
        COMPUTED,
        references=REFERENCES,
    )
    of_campaign = dict.fromkeys(("campaign", "study", "config_sha256", "license"), "")
    return with_bounds(xr.Dataset(variables, coordinates, attrs | of_campaign))
