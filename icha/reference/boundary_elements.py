"""The same contact by boundary elements: a solution that owes nothing to asperities.

Tamaas (L. Frérot et al., J. Open Source Softw. 5 (2020) 2121, doi:10.21105/joss.02121) minimises the energy of an
elastic half-space against the nodes of the topography: without adhesion in the pressures, at given load (I. A.
Polonsky and L. M. Keer, Wear 231 (1999) 206, doi:10.1016/S0043-1648(99)00113-1); with adhesion in the gaps, at given
mean gap (V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69, doi:10.1007/s00466-017-1392-5), the
traction being (dgamma/rho) exp(-u/rho) outside a hard wall. Its load control ends in other states when there is
adhesion, and calls them converged; so the mean gap that carries a given load is searched for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import tamaas
import tamaas.utils
import xarray as xr

from icha.cohesive_zone import longest_spacing, resolution_problem, strength_number
from icha.jkr import JKR
from icha.material import Material
from icha.observables import GAP_BINS, PRESSURE_BINS
from icha.surface import Surface
from icha.validation import integer, positive

# What is minimised is known to this relative error.
DEFAULT_TOLERANCE = 1e-8
# A load is met to this relative error by the search for its mean gap.
LOAD_TOLERANCE = 2e-4
_MAX_SOLVES = 20
_MAX_ITERATIONS = 100_000
# The first steps of the search, in h_rms: loads fall by a factor e over about this distance, on rough surfaces.
_DECAY = 0.4
_LONGEST_STEP = 0.3

REFERENCES = (
    "L. Frérot et al., J. Open Source Softw. 5 (2020) 2121, doi:10.21105/joss.02121; "
    "I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206-219, doi:10.1016/S0043-1648(99)00113-1; "
    "V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69-81, doi:10.1007/s00466-017-1392-5; "
    "V. A. Yastrebov, G. Anciaux and J.-F. Molinari, Tribol. Int. 114 (2017) 161-171, "
    "doi:10.1016/j.triboint.2017.04.023"
)

# name: (dimensions, units, long name)
VARIABLES = {
    "mean_separation": ((), "m", "mean gap"),
    "nominal_pressure": ((), "Pa", "mean traction over the nominal area, attraction included"),
    "reduced_pressure": ((), "1", "nominal pressure over contact modulus and rms slope, p/(E* h'rms)"),
    "target_reduced_pressure": ((), "1", "reduced pressure asked for"),
    "load_error": ((), "1", "nominal pressure over the one asked for, less 1"),
    "reduced_separation": ((), "1", "mean gap over rms height"),
    "contact_area_fraction": ((), "1", "real over nominal contact area, A/A0, corrected by the contact's perimeter"),
    "contact_area_fraction_raw": ((), "1", "fraction of the nodes in contact"),
    "contact_perimeter": ((), "m", "edges between nodes in contact and out of contact, of one cell of the surface"),
    "outside_pressure": ((), "Pa", "mean over the nominal area of the traction outside the contact"),
    "residual": ((), "1", "error of the solver: its criterion of convergence"),
    "tolerance": ((), "1", "error of the solver at which it was to stop"),
    "solve_count": ((), "1", "solutions until the load was met"),
    "refinement": ((), "1", "cells per cell of the surface's grid, along a side"),
    "grid": ((), "1", "nodes along a side"),
    "spacing": ((), "m", "distance between nodes"),
    "longest_spacing": ((), "m", "widest spacing that resolves the cohesive zone; 0 without adhesion"),
    "strength_number": ((), "1", "sqrt(dgamma dx/E*)/range; 0 without adhesion"),
    "gap_density": (("gap_bin",), "m-1", "probability density of the gap out of contact, over the nominal area"),
    "gap_bin_edges": (("gap_edge",), "m", "edges of the gap bins"),
    "pressure_density": (
        ("pressure_bin",),
        "Pa-1",
        "probability density of the pressure in contact, over the nominal area",
    ),
    "pressure_bin_mean": (("pressure_bin",), "Pa", "mean pressure of the area in the bin, 0 where empty"),
    "pressure_bin_edges": (("pressure_edge",), "Pa", "edges of the pressure bins"),
    "contact": (("y", "x"), "1", "1 where the node is in contact"),
    "contact_modulus": ((), "Pa", "composite contact modulus E*"),
    "surface_energy": ((), "J m-2", "energy of adhesion per area"),
    "interaction_range": ((), "m", "range of the attractive forces"),
    "rms_slope": ((), "1", "root mean square slope |grad h| from the spectrum"),
    "rms_height": ((), "m", "root mean square height"),
    "rms_curvature": ((), "m-1", "root mean square curvature of a profile, from the spectrum"),
    "tabor_parameter": ((), "1", "Tabor parameter with the radius 1/rms_curvature"),
    "period": ((), "m", "side of the periodic cell"),
    "seed": ((), "1", "seed of the surface; -1 where it has none"),
}


class NotSolved(RuntimeError):
    """The boundary elements did not converge, or no mean gap carries the load; the message says which."""


def boundary_elements(
    surface: Surface,
    material: Material,
    reduced_pressure: float,
    *,
    refinement: int = 1,
    tolerance: float = DEFAULT_TOLERANCE,
    seed: int = -1,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Press the surface against the half-space at one load, by boundary elements.

    Parameters
    ----------
    surface, material : as for `icha.simulate`; with adhesion, traction decays over `material.interaction_range`.
    reduced_pressure : p/(E* h'_rms), positive.
    refinement : nodes per node of the surface's grid, along a side.
    tolerance : relative error at which the solver may stop.
    seed : recorded in the dataset.
    progress : called with lines of text: first the numbers that say whether the grid resolves the attraction.

    Returns
    -------
    xarray.Dataset of one state (see `VARIABLES`). Densities are over the nominal area: the integral of `gap_density`
    and the raw area make 1, that of `pressure_density` is the raw area; the bins are those of `icha.simulate`.

    Raises
    ------
    ValueError
        If an argument is out of range, or the grid does not resolve the attraction.
    NotSolved
        If the solver does not reach its tolerance, or no mean gap is found that carries the load.
    """
    target = positive("reduced_pressure", reduced_pressure)
    tolerance = positive("tolerance", tolerance)
    fine = surface.refined(integer("refinement", refinement, 1))
    say = progress or (lambda line: None)
    adhesive = material.surface_energy > 0
    say(
        f"{fine.grid} nodes a side, spacing {fine.spacing:.4g} m"
        + (
            f"; with adhesion at most {longest_spacing(material):.4g} m; sqrt(dgamma dx/E*)/range = "
            f"{strength_number(material, fine.spacing):.3g}"
            if adhesive
            else ""
        )
    )
    if problem := resolution_problem(material, fine.spacing):
        raise ValueError(f"interaction_range: {problem}")

    # Lengths in h_rms, pressures in E*. One thread: sums keep their order, and results their bytes.
    tamaas.initialize(1)
    height = surface.rms_height
    pressure = target * surface.rms_slope
    with tamaas.utils.log_context(tamaas.LogLevel.error):
        state = _without_adhesion(fine, height, pressure, tolerance)
        if adhesive:
            state = _with_adhesion(fine, height, material, pressure, tolerance, state[0].mean(), say)
    gap, traction, contact, residual, solves = state
    return _dataset(surface, fine, material, target, tolerance, seed, (gap, traction, contact, residual, solves))


def _model(fine, height):
    """A half-space of E* = 1 below the nodes, and the heights of these."""
    model = tamaas.Model(tamaas.model_type.basic_2d, [fine.period / height] * 2, [fine.grid] * 2)
    model.E, model.nu = 1.0, 0.0
    return model, fine.heights / height


def _solver(model, heights, tolerance, variable):
    solver = tamaas.PolonskyKeerRey(model, heights, tolerance, variable, variable)
    solver.max_iter = _MAX_ITERATIONS
    return solver


def _solve(solver, stop, tolerance):
    residual = solver.solve(stop)
    if not residual <= tolerance:
        raise NotSolved(f"boundary elements did not converge: error {residual:.3g}, tolerance {tolerance:g}")
    return residual


def _without_adhesion(fine, height, pressure, tolerance):
    model, heights = _model(fine, height)
    solver = _solver(model, heights, tolerance, tamaas.PolonskyKeerRey.pressure)
    residual = _solve(solver, pressure, tolerance)
    traction = np.array(model.traction)
    contact = traction > 0
    gap = np.asarray(model.displacement) - heights
    # The displacement is known up to a constant.
    gap -= gap[contact].mean()
    return gap, traction, contact, residual, 1


def _with_adhesion(fine, height, material, pressure, tolerance, mean_gap, say):
    """Search for the mean gap of a given mean traction, from the one without adhesion."""
    model, heights = _model(fine, height)
    solver = _solver(model, heights, tolerance, tamaas.PolonskyKeerRey.gap)
    attraction = tamaas.ExponentialAdhesionFunctional(heights)
    attraction.parameters = {
        "rho": material.interaction_range / height,
        "surface_energy": material.adhesion_length / height,
    }
    solver.addFunctionalTerm(attraction)
    tried: list[tuple[float, float]] = []
    while len(tried) < _MAX_SOLVES:
        residual = _solve(solver, mean_gap, tolerance)
        traction = np.array(model.traction)
        error = float(traction.mean()) / pressure - 1
        tried.append((mean_gap, error))
        say(f"mean gap {mean_gap:.8g} h_rms: load {1 + error:.6g} of the one asked for, error {residual:.2g}")
        if abs(error) <= LOAD_TOLERANCE:
            gap = np.array(model["gap"])
            return gap, traction, gap <= 0, residual, len(tried)
        mean_gap = _next_gap(tried)
    raise NotSolved(f"no mean gap was found that carries the load: {len(tried)} tries, the last off by {error:.3g}")


def _next_gap(tried):
    """Secant in the load, kept within the mean gaps known to carry too much and too little."""
    gap, error = tried[-1]
    step = _DECAY * (math.log1p(error) if error > -0.9 else -1.0)
    if len(tried) > 1:
        before, error_before = tried[-2]
        if error != error_before:
            step = -error * (gap - before) / (error - error_before)
    step = min(max(step, -_LONGEST_STEP), _LONGEST_STEP)
    too_much = max((g for g, e in tried if e > 0), default=None)
    too_little = min((g for g, e in tried if e < 0), default=None)
    following = gap + step
    if too_much is not None and too_little is not None and not too_much < following < too_little:
        following = 0.5 * (too_much + too_little)
    return following


def perimeter_correction(contact: np.ndarray) -> tuple[float, float]:
    """Contact area fraction corrected by the perimeter, and the perimeter in spacings, of a periodic map of contact.

    Nodes along the edge overestimate an area by (pi - 1 + ln 2)/24 of the perimeter times the spacing (Yastrebov,
    Anciaux & Molinari 2017, eq. 9 there).
    """
    edges = sum(int(np.count_nonzero(contact != np.roll(contact, 1, axis))) for axis in (0, 1))
    return (np.count_nonzero(contact) - (math.pi - 1 + math.log(2)) / 24 * edges) / contact.size, float(edges)


def _dataset(surface, fine, material, target, tolerance, seed, state):
    gap, traction, contact, residual, solves = state
    height, modulus = surface.rms_height, material.contact_modulus
    area, edges = perimeter_correction(contact)
    nodes = contact.size
    adhesive = material.surface_energy > 0
    gaps, _ = np.histogram(np.maximum(gap[~contact], 0.0), GAP_BINS)
    # Pressures in units of E* h'_rms.
    inside = traction[contact] / surface.rms_slope
    count, _ = np.histogram(inside, PRESSURE_BINS)
    load, _ = np.histogram(inside, PRESSURE_BINS, weights=inside)
    if gaps.sum() + count.sum() != nodes:
        raise NotSolved("gaps or pressures lie beyond the bins of their distributions")
    unit = modulus * surface.rms_slope
    mean = float(traction.mean())
    values = {
        "mean_separation": gap.mean() * height,
        "nominal_pressure": mean * modulus,
        "reduced_pressure": mean / surface.rms_slope,
        "target_reduced_pressure": target,
        "load_error": mean / (target * surface.rms_slope) - 1,
        "reduced_separation": gap.mean(),
        "contact_area_fraction": area,
        "contact_area_fraction_raw": np.count_nonzero(contact) / nodes,
        "contact_perimeter": edges * fine.spacing,
        "outside_pressure": traction[~contact].sum() / nodes * modulus,
        "residual": residual,
        "tolerance": tolerance,
        "solve_count": solves,
        "refinement": fine.grid // surface.grid,
        "grid": fine.grid,
        "spacing": fine.spacing,
        "longest_spacing": longest_spacing(material) if adhesive else 0.0,
        "strength_number": strength_number(material, fine.spacing),
        "gap_density": gaps / nodes / np.diff(GAP_BINS * height),
        "gap_bin_edges": GAP_BINS * height,
        "pressure_density": count / nodes / np.diff(PRESSURE_BINS * unit),
        "pressure_bin_mean": np.divide(load, count, out=np.zeros(len(load)), where=count > 0) * unit,
        "pressure_bin_edges": PRESSURE_BINS * unit,
        "contact": contact.astype(np.int8),
        "contact_modulus": modulus,
        "surface_energy": material.surface_energy,
        "interaction_range": material.interaction_range,
        "rms_slope": surface.rms_slope,
        "rms_height": height,
        "rms_curvature": surface.rms_curvature,
        "tabor_parameter": float(JKR(material).tabor_parameter(1 / surface.rms_curvature)),
        "period": surface.period,
        "seed": seed,
    }
    variables = {
        name: (dims, values[name], {"units": units, "long_name": long_name})
        for name, (dims, units, long_name) in VARIABLES.items()
    }
    nodes = np.arange(fine.grid) * fine.spacing
    coordinates = {axis: (axis, nodes, {"units": "m", "long_name": f"{axis} of the nodes"}) for axis in ("x", "y")}
    adhesion = "with" if adhesive else "without"
    return xr.Dataset(
        variables,
        coordinates,
        attrs={
            "title": f"Rough contact {adhesion} adhesion, boundary elements",
            "summary": "One state of a periodic rough surface against an elastic half-space, by boundary elements.",
            "Conventions": "CF-1.11",
            "source": f"tamaas {version('tamaas')}",
            "references": REFERENCES,
        },
    )
