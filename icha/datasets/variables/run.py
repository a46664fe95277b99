"""Variables of the dataset of a run."""

import numpy as np

from icha.asperity.full_contact import MEANING
from icha.contact.model import EVENT_KINDS
from icha.contact.models import MODELS
from icha.datasets.build import bin_table
from icha.datasets.variables.terms import INFINITE, MATERIAL, ROUGHNESS, Variable, term, terms

_STEP, _SNAPSHOT, _SPOT, _EVENT = ("step",), ("snapshot",), ("spot",), ("event",)
_GAP_BIN, _PRESSURE_BIN = ("snapshot", "gap_bin"), ("snapshot", "pressure_bin")
# The cells of the surface's grid: rows along y, columns along x.
CELLS = ("row", "column")


def _index_of(dim):
    """Attributes of an index of CF's indexed ragged arrays (CF 1.11, section 9.3.4).

    Spots and events are kept one after the other, and it says to which snapshot or step each belongs. CF's feature
    types, all of a time or a place on earth, are not claimed.
    """
    return {
        "instance_dimension": dim,
        "comment": "index of a ragged array: positions along instance_dimension, from 0",
    }


RUN = {
    "step": Variable(_STEP, "1", "equilibrium along the path", int, coordinate=True),
    "branch": Variable(_STEP, "1", "branch of the path: loading or unloading", str, coordinate=True),
    "snapshot": Variable(_SNAPSHOT, "1", "snapshot", int, coordinate=True),
    "mean_separation": Variable(
        _STEP,
        "m",
        "mean separation of the surfaces; for a free square, that of its mean plane and the half-space far away",
    ),
    "mean_gap": Variable(
        _STEP,
        "m",
        "mean gap over the nominal area: for a periodic surface, the mean separation; for a free square, it differs by "
        "the mean displacement of the half-space there",
    ),
    "nominal_pressure": Variable(_STEP, "Pa", "force over nominal area"),
    **terms("contact_area_fraction", along=_STEP),
    "spot_count": Variable(_STEP, "1", "number of contact spots", int),
    "contact_stiffness": Variable(_STEP, "Pa m^-1", "contact stiffness, -dp/du of the present spots"),
    "residual": Variable(_STEP, "1", "largest equilibrium error over h_rms"),
    "converged": Variable(_STEP, "1", "1 where the equilibrium converged", np.int8),
    "leg": Variable(_STEP, "1", "leg of the path: 0 the first loading, odd unloading, even loading again", int),
    # Coordinates, so that whatever lies along the path can be plotted against load or separation by xarray alone.
    **{name: term(name)._replace(dims=_STEP, coordinate=True) for name in ("reduced_pressure", "reduced_separation")},
    "step_kind": Variable(_STEP, "1", "quantity that this step was asked to reach", str),
    "step_target": Variable(_STEP, "1", "value asked for, in the SI unit of its kind"),
    "jump_in_count": Variable(_STEP, "1", "contacts formed so far", int),
    "jump_off_count": Variable(_STEP, "1", "contacts broken so far", int),
    "coalescence_count": Variable(_STEP, "1", "unions of two spots so far", int),
    "split_count": Variable(_STEP, "1", "united spots so far that detached and left asperities in contact", int),
    "pending_count": Variable(
        _STEP, "1", "asperities past jump-in left free after breaking contact at the same step", int
    ),
    "outside_wu_fraction": Variable(
        _STEP,
        "1",
        "fraction of single-asperity spots (boundary elements: of summits in contact) with a Tabor parameter below 1",
    ),
    "snapshot_step": Variable(_SNAPSHOT, "1", "step of the snapshot", int),
    "snapshot_kind": Variable(_SNAPSHOT, "1", "quantity that the snapshot was asked to reach", str),
    "snapshot_target": Variable(_SNAPSHOT, "1", "value asked for, in the SI unit of its kind"),
    "overlap_fraction": Variable(_SNAPSHOT, "1", "area fraction outside the spots where the computed gap is negative"),
    "area_beyond_edges": Variable(
        _SNAPSHOT,
        "1",
        "part of the nominal area by which A/A0 exceeds what spots cover of it: where they extend beyond the edges of "
        "a free square, and where two that a union came apart into overlap",
    ),
    "gap_density": Variable(_GAP_BIN, "m^-1", "probability density of the gap over the nominal area"),
    "pressure_density": Variable(
        _PRESSURE_BIN, "Pa^-1", "probability density of the contact pressure over the nominal area"
    ),
    **terms("pressure_bin_mean", along=_PRESSURE_BIN),
    **bin_table("gap", "m"),
    **bin_table("pressure", "Pa"),
    "spot_snapshot": Variable(_SPOT, "1", "snapshot to which the spot belongs", int, _index_of("snapshot")),
    "spot_x": Variable(_SPOT, "m", "x of the spot's centre"),
    "spot_y": Variable(_SPOT, "m", "y of the spot's centre"),
    "spot_radius": Variable(_SPOT, "m", "contact radius, that of a circle of the same area"),
    "spot_area": Variable(_SPOT, "m^2", "contact area"),
    "spot_perimeter": Variable(_SPOT, "m", "length of the edge of the contact area"),
    "spot_force": Variable(_SPOT, "N", "contact force, negative in tension"),
    "spot_curvature_radius": Variable(
        _SPOT, "m", "radius of curvature of the spot's paraboloid; for boundary elements, that of its highest summit"
    ),
    "spot_members": Variable(
        _SPOT, "1", "number of asperities united in the spot; for boundary elements, of the summits in it", int
    ),
    **terms(*MATERIAL, *ROUGHNESS),
    "spectral_moment_0": Variable((), "m^2", "spectral moment m0 of a profile: variance of its height"),
    "spectral_moment_2": Variable((), "1", "spectral moment m2 of a profile: variance of its slope"),
    "spectral_moment_4": Variable((), "m^-2", "spectral moment m4 of a profile: variance of its curvature"),
    **terms("nayak_parameter"),
    "period": Variable((), "m", "side of the periodic cell, or of the free square"),
    "boundary": Variable((), "1", "what lies beyond the cell: periodic or free", str),
    "grid": Variable((), "1", "nodes along a side of the cell", int),
    **terms("seed", "tabor_parameter"),
    "stickiness": Variable((), "1", "attraction over repulsion after Pastewka and Robbins; above 1 surfaces stick"),
    "full_contact_energy_ratio": Variable(
        (),
        "1",
        f"elastic energy of full contact over the work of adhesion, U_full/dgamma; {MEANING}",
        further={INFINITE: "without adhesion"},
    ),
    "height_skewness": Variable((), "1", "skewness of the heights; 0 for a Gaussian surface"),
    "height_kurtosis": Variable((), "1", "kurtosis of the heights; 3 for a Gaussian surface"),
    "slope_anisotropy": Variable(
        (),
        "1",
        "largest over smallest rms slope along all directions; 1 for an isotropic surface",
        further={INFINITE: "for straight grooves"},
    ),
    "asperity_count": Variable((), "1", "number of asperities on the surface", int),
    "unsupported_summit_count": Variable(
        (), "1", "number of maxima of the interpolated surface that are no asperities, as no nodes support them", int
    ),
    "control": Variable((), "1", "what is imposed: separation or load", str),
}

# Besides, what the runs of a model have ...
FURTHER = {
    name: {key: Variable(*own, np.dtype(kind).type) for key, (*own, kind) in model.variables.items()}
    for name, model in MODELS.items()
}
OF_MODELS = {key: description for table in FURTHER.values() for key, description in table.items()}

# ... those of a path that goes on after the first loading ...
CYCLE = {
    "work": Variable(
        _STEP,
        "J m^-2",
        "work done on the contact since first contact, -(integral of p du), "
        "cubic between steps, by pressure and contact stiffness, and at constant pressure in a jump under load control",
    ),
    "stored_energy": Variable(_STEP, "J m^-2", "elastic energy minus that of adhesion; 0 out of contact"),
    "dissipated_by_jump_in": Variable(_STEP, "J m^-2", "energy lost so far as contacts formed"),
    "dissipated_by_jump_off": Variable(_STEP, "J m^-2", "energy lost so far as contacts broke"),
    "dissipated_by_coalescence": Variable(_STEP, "J m^-2", "energy lost so far as spots united or unions were undone"),
    "dissipated_by_load_jump": Variable(
        _STEP, "J m^-2", "energy lost so far in jumps at constant load, under load control"
    ),
    "event_kind": Variable(
        _EVENT,
        "1",
        "kind of the event",
        np.int8,
        {"flag_values": np.arange(len(EVENT_KINDS), dtype=np.int8), "flag_meanings": " ".join(EVENT_KINDS)},
    ),
    "event_step": Variable(_EVENT, "1", "step at which the event is first seen", int, _index_of("step")),
    "event_separation": Variable(_EVENT, "m", "mean separation of that step"),
    "event_x": Variable(_EVENT, "m", "x of the centre of the spot concerned"),
    "event_y": Variable(_EVENT, "m", "y of the centre of the spot concerned"),
    "event_members": Variable(_EVENT, "1", "number of asperities in the spot concerned", int),
}
_ONLY_THE_SUM = "where uphill_jump_in_count is not 0, only the sum with the other kind of jump has a meaning"
# ... and of one that ends in separation.
LOOP = {
    "pull_off_pressure": Variable((), "Pa", "largest tension on the last unloading"),
    "pull_off_separation": Variable((), "m", "mean separation at the largest tension"),
    "pull_off_over_strength": Variable(
        (),
        "1",
        "largest tension over the strength of the interface, 16 dgamma/(9 sqrt(3) range); 0 without adhesion",
    ),
    "pull_off_over_summits": Variable(
        (),
        "1",
        "largest tension over that of all asperities pulling their most at once, 3/2 pi dgamma sum(R)/A0; "
        "0 without adhesion",
    ),
    "detachment_pressure": Variable((), "Pa", "nominal pressure just before the last contact breaks"),
    "detachment_separation": Variable((), "m", "mean separation just before the last contact breaks"),
    "hysteresis_loss": Variable(
        (), "J m^-2", "work lost from first contact to separation, integral of p du around the path"
    ),
    "hysteresis_loss_over_surface_energy": Variable(
        (), "1", "work lost over the energy of adhesion; 0 without adhesion"
    ),
    "loss_by_jump_in": Variable(
        (), "J m^-2", "part of the loss in jumps into contact", further={"comment": _ONLY_THE_SUM}
    ),
    "loss_by_jump_off": Variable(
        (), "J m^-2", "part of the loss in jumps out of contact", further={"comment": _ONLY_THE_SUM}
    ),
    "uphill_jump_in_count": Variable(
        (), "1", "number of jumps into contact that take energy, by the law of a single spot", int
    ),
    "loss_by_coalescence": Variable((), "J m^-2", "part of the loss in unions of spots and their undoing"),
    "loss_by_load_jump": Variable((), "J m^-2", "part of the loss in jumps at constant load, under load control"),
    "loss_unattributed": Variable(
        (), "J m^-2", "part of the loss that no event explains: non-reciprocal interaction and integration"
    ),
    "largest_contact_area_fraction": Variable((), "1", "largest A/A0 on the path"),
    "largest_reduced_pressure": Variable((), "1", "largest reduced pressure on the path"),
}
