"""Contacts of periodic surfaces solved by Tamaas, an independent code for boundary elements (`make tamaas`).

Tamaas finds the pressures at a given load without adhesion (I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206-219),
and the gaps at a given mean gap with adhesion (V. Rey, G. Anciaux and J.-F. Molinari, Comput. Mech. 60 (2017) 69-81).
The traction at a gap u is -(dgamma/rho) exp(-u/rho), with the range of attraction rho. Source of Tamaas: L. Frérot et
al., J. Open Source Softw. 5 (2020) 2121.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import tamaas
import tamaas.utils

from icha.asperity.material import Material
from icha.boundary_elements.patches import BEYOND_EDGES
from icha.surfaces.surface import Surface

_MAX_ITERATIONS = 100_000


class OracleState(NamedTuple):
    """State of a contact at the nodes of its grid.

    Attributes
    ----------
    gap : (n, n) float, m; zero in contact.
    traction : (n, n) float, Pa, positive in compression.
    """

    gap: np.ndarray
    traction: np.ndarray

    @property
    def area_fraction(self) -> float:
        """Area of zero gap divided by the nominal area, corrected for the perimeter as in `icha.boundary_elements`."""
        contact = self.gap <= 0
        edges = sum(np.count_nonzero(contact != np.roll(contact, 1, axis)) for axis in (0, 1))
        return (np.count_nonzero(contact) - BEYOND_EDGES * edges) / contact.size


def contact_at_load(surface: Surface, material: Material, pressure: float, tolerance: float = 1e-8) -> OracleState:
    """Return the contact without adhesion at a nominal pressure, Pa."""
    solver, model, unit = _solver_of(surface, tamaas.PolonskyKeerRey.pressure, tolerance)
    _solve(solver, pressure / material.contact_modulus, tolerance)
    traction = np.array(model.traction)
    # Tamaas gives the displacement only up to an additive constant.
    gap = model.displacement - surface.heights / unit
    gap = np.where(traction > 0, 0.0, gap - gap[traction > 0].mean())
    return OracleState(gap * unit, traction * material.contact_modulus)


def contacts_at_gaps(
    surface: Surface, material: Material, mean_gaps: Iterable[float], tolerance: float = 1e-8
) -> Iterator[OracleState]:
    """Yield the contacts with adhesion at mean gaps, m, with nodes in contact; each starts from the last one."""
    solver, model, unit = _solver_of(surface, tamaas.PolonskyKeerRey.gap, tolerance)
    # Tamaas stores only a reference to the object, so the object must exist as long as the solver.
    attraction = tamaas.ExponentialAdhesionFunctional(surface.heights / unit)
    attraction.parameters = {
        "rho": material.interaction_range / unit,
        "surface_energy": material.adhesion_length / unit,
    }
    solver.addFunctionalTerm(attraction)
    for mean_gap in mean_gaps:
        _solve(solver, mean_gap / unit, tolerance)
        yield OracleState(np.array(model["gap"]) * unit, np.array(model.traction) * material.contact_modulus)


def _solver_of(surface, variable, tolerance):
    """Return a solver for given means of a variable, its model, and the unit of lengths, m; pressures are in E*."""
    # With one thread, sums always have the same order, so the same input gives the same bytes.
    tamaas.initialize(1)
    unit = surface.rms_height
    model = tamaas.Model(tamaas.model_type.basic_2d, [surface.period / unit] * 2, [surface.grid] * 2)
    model.E, model.nu = 1.0, 0.0
    solver = tamaas.PolonskyKeerRey(model, surface.heights / unit, tolerance, variable, variable)
    solver.max_iter = _MAX_ITERATIONS
    return solver, model, unit


def _solve(solver, mean, tolerance):
    """Solve the contact at a mean pressure or gap; raise `RuntimeError` if the error exceeds the tolerance."""
    with tamaas.utils.log_context(tamaas.LogLevel.error):
        error = solver.solve(mean)
    if not error <= tolerance:
        raise RuntimeError(f"Tamaas did not converge: relative error {error:.3g}, tolerance {tolerance:g}")
