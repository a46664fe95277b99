"""Variables of solutions by boundary elements: one state, and a loop."""

import numpy as np

from icha.datasets.build import bin_table
from icha.datasets.variables.terms import MATERIAL, ROUGHNESS, Variable, terms

_STEP = ("step",)

SOLUTION = {
    **terms("x", "y"),
    "mean_separation": Variable((), "m", "mean separation, which is the mean gap"),
    "nominal_pressure": Variable((), "Pa", "mean traction over the nominal area, attraction included"),
    **terms("reduced_pressure"),
    "target_reduced_pressure": Variable((), "1", "reduced pressure asked for"),
    "load_error": Variable((), "1", "nominal pressure over the one asked for, minus 1"),
    "reduced_separation": Variable((), "1", "mean separation over rms height"),
    "contact_area_fraction": Variable(
        (), "1", "real over nominal contact area, A/A0, corrected by the contact's perimeter"
    ),
    "contact_area_fraction_raw": Variable((), "1", "fraction of the nodes in contact"),
    "energetic_area_fraction": Variable(
        (), "1", "energy of adhesion over that of full contact; the raw area without adhesion"
    ),
    "contact_perimeter": Variable(
        (), "m", "length of the edges between nodes in contact and out of contact, in one cell of the surface"
    ),
    "outside_pressure": Variable((), "Pa", "mean over the nominal area of the traction outside the contact"),
    "residual": Variable((), "1", "error of the solver: its criterion of convergence"),
    "tolerance": Variable((), "1", "error of the solver at which it may stop"),
    "solve_count": Variable((), "1", "number of solutions until the load was met", int),
    "refinement": Variable((), "1", "cells per cell of the surface's grid, along a side", int),
    **terms("grid", "spacing", "longest_spacing", "strength_number"),
    "gap_density": Variable(
        ("gap_bin",), "m^-1", "probability density of the gap out of contact, over the nominal area"
    ),
    **bin_table("gap", "m"),
    "pressure_density": Variable(
        ("pressure_bin",), "Pa^-1", "probability density of the pressure in contact, over the nominal area"
    ),
    **terms("pressure_bin_mean", along=("pressure_bin",)),
    **bin_table("pressure", "Pa"),
    "contact": Variable(("y", "x"), "1", "1 where the node is in contact", np.int8),
    **terms(*MATERIAL, *ROUGHNESS, "tabor_parameter", "period", "seed"),
}


def _as_in_solution(*names, along=()):
    return {name: SOLUTION[name]._replace(dims=along) for name in names}


LOOP = {
    "step": Variable(_STEP, "1", "state of the loop", int, coordinate=True),
    **_as_in_solution("mean_separation", "nominal_pressure", "reduced_pressure", "reduced_separation", along=_STEP),
    "contact_area_fraction": Variable(_STEP, "1", "area of zero gap over the nominal area, corrected by its perimeter"),
    **_as_in_solution("contact_area_fraction_raw", "energetic_area_fraction", "residual", along=_STEP),
    "leg": Variable(_STEP, "1", "0 on the way down, 1 on the way up", int),
    "work": Variable(_STEP, "J m^-2", "work done on the contact so far, minus the integral of pressure over mean gap"),
    "stored_energy": Variable(_STEP, "J m^-2", "elastic energy minus that of adhesion, per nominal area"),
    "dissipated": Variable(_STEP, "J m^-2", "work so far minus the change of the stored energy: lost in jumps"),
    "pull_off_pressure": Variable((), "Pa", "largest tension on the way up, at least 0"),
    "pull_off_separation": Variable((), "m", "mean separation at the largest tension on the way up"),
    "hysteresis_loss": Variable((), "J m^-2", "work of the whole loop"),
    "hysteresis_loss_error": Variable(
        (),
        "J m^-2",
        "estimate of the error of the loss, from the trapezoidal rule and from steps in which the pressure jumps",
    ),
    "largest_reduced_pressure": Variable((), "1", "largest nominal pressure over contact modulus and rms slope"),
    "largest_contact_area_fraction": Variable((), "1", "largest area of zero gap over the nominal area, corrected"),
    "separation_step": Variable((), "1", "largest step of the mean gap over rms height"),
    "solve_count": Variable((), "1", "number of solutions, including those replaced by smaller steps", int),
    **_as_in_solution("tolerance", "refinement"),
    **terms("grid", "spacing", "longest_spacing", "strength_number"),
    **terms(*MATERIAL, *ROUGHNESS, "tabor_parameter", "period", "seed"),
    "branch": Variable(_STEP, "1", "loading on the way down, unloading on the way up", str),
}
