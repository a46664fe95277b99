"""Boundary elements with a law of attraction that ICHA does not contain, and with a work of adhesion in stripes."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize

import icha
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.elastic import HalfSpace
from icha.boundary_elements.laws import AtDistance, Cohesive, ShortRange, average
from icha.boundary_elements.minimise import Control, Problem, Shift, minimise

MODULUS, GRID = 1e6, 64
SURFACE = icha.SelfAffineSpectrum(1e-4, 5e-5, 1e-4 / 8, 0.8, 0.1).realise(GRID, 1)
# Heights and their root mean square in cell sizes; largest displacement by residual pressures. Bonds that soften make
# the error of a gap up to three times as large.
HEIGHTS, UNIT = SURFACE.heights / SURFACE.spacing, SURFACE.rms_height / SURFACE.spacing
TOLERANCE = 1e-9 * UNIT
# Relative tolerance of Tamaas.
TAMAAS_TOLERANCE = 1e-8


@dataclasses.dataclass(frozen=True, eq=False)
class Exponential(AtDistance):
    """Attraction that decreases exponentially with the gap, without cut-off.

    Parameters
    ----------
    work : work of adhesion over E*, in cell sizes.
    decay : length over which the tension falls by the factor e, in cell sizes.
    """

    work: float
    decay: float

    @property
    def strength(self):
        """Tension at zero gap, in E*."""
        return self.work / self.decay

    @property
    def reach(self):
        """Gap beyond which the tension is negligible, in cell sizes."""
        return 20 * self.decay

    def tension(self, gap):
        """Return the tension of each cell, in E*."""
        return self.strength * np.exp(-gap / self.decay)

    def energy(self, gap):
        """Return the energy of each cell, in E* times cell size^3."""
        return -self.work * np.exp(-gap / self.decay)

    def softening(self, gap):
        """Return the fall of the tension with the gap, in E* per cell size."""
        return self.tension(gap) / self.decay

    def gap(self, fraction):
        """Return the gap of each cell from its fraction, in cell sizes."""
        return -self.decay * np.log(fraction)


def material_of(adhesion, reach):
    """Return a material with dgamma/E* in units of 0.03 h_rms, and with the range of attraction in h_rms."""
    return icha.Material(MODULUS, adhesion * 0.03 * SURFACE.rms_height * MODULUS, reach * SURFACE.rms_height)


def exponential_law(material):
    """Return the exponential law of a material on the grid."""
    return Exponential(material.adhesion_length / SURFACE.spacing, material.interaction_range / SURFACE.spacing)


def solve(law, control, start=None):
    """Find the equilibrium from a position, (n, n), or from a flat body that touches the highest cell."""
    position = np.full(HEIGHTS.shape, HEIGHTS.max()) if start is None else start
    problem = Problem(HalfSpace.under(GRID), law, HEIGHTS)
    return minimise(problem, position, np.zeros(HEIGHTS.shape), control, TOLERANCE)


@pytest.mark.parametrize(("adhesion", "reach"), [(0.05, 0.3), (0.3, 0.3), (1, 1)])
def test_exponential_attraction_gives_the_contacts_of_tamaas(adhesion, reach):
    """The grid resolves these ranges: gaps are stable, so both codes find the same minimum."""
    pytest.importorskip("tamaas")
    from validation.tamaas_oracle import contacts_at_gaps

    material, position = material_of(adhesion, reach), None
    law, mean_gaps = exponential_law(material), np.array([2.0, 1.2, 0.6])
    by_tamaas = contacts_at_gaps(SURFACE, material, mean_gaps * SURFACE.rms_height, TAMAAS_TOLERANCE)
    for mean_gap, tamaas in zip(mean_gaps, by_tamaas, strict=True):
        found = solve(law, Control(mean=mean_gap * UNIT), position)
        position, gap, other_gap = found.position, found.position - HEIGHTS, tamaas.gap / SURFACE.spacing
        scale = np.abs(found.pressure).max()
        assert gap.mean() == pytest.approx(mean_gap * UNIT, rel=1e-12)
        assert found.load == pytest.approx(tamaas.traction.mean() / MODULUS, rel=0, abs=TAMAAS_TOLERANCE * scale)
        assert np.abs(gap - other_gap).max() <= TAMAAS_TOLERANCE * UNIT
        assert np.abs(found.pressure - tamaas.traction / MODULUS).max() <= 5 * TAMAAS_TOLERANCE * scale
        assert np.array_equal(gap == 0, other_gap <= 0) and (gap == 0).any()


def load_of(load, factor=1.0):
    """Return the control of a load with the shift of a rigid body, of a stiffness with a factor."""
    return Control(load=load, shift=Shift(np.ones(HEIGHTS.shape), factor * load * HEIGHTS.size / UNIT))


def test_the_expected_shift_does_not_change_the_contact():
    """The stiffness of the shift is up to fifty times too large or too small."""
    law = exponential_law(material_of(0.05, 0.3))
    found = [solve(law, load_of(0.01, factor)) for factor in (0.02, 1, 50)]
    positions = np.stack([each.position for each in found])
    assert np.ptp(positions, axis=0).max() <= 6 * TOLERANCE
    assert np.array_equal(found[0].held, found[2].held) and found[0].held.any()


# Factors of the work of adhesion: stripes of 8 cells with 0.3 and with 3, and the same everywhere.
STRIPES = np.broadcast_to(np.where(np.arange(GRID) // 8 % 2, 3.0, 0.3), HEIGHTS.shape)
UNIFORM = np.ones(HEIGHTS.shape)


def contact_with_factors(attraction, factors):
    """Return a contact with a law of attraction whose work of adhesion has a factor in each cell, (n, n)."""
    material = material_of(*((0.3, 0.5) if attraction is Cohesive else (0.03, 1e-6)))
    works = material.surface_energy * factors
    return contact_of(SURFACE, icha.Material(MODULUS, works, material.interaction_range))


@pytest.mark.parametrize("attraction", [Cohesive, ShortRange])
def test_stripes_have_the_contacts_that_an_independent_minimiser_finds(attraction):
    """At a short range, the works of adhesion and the attracting cells are those of the equilibrium."""
    contact = contact_with_factors(attraction, STRIPES)
    assert type(contact.attraction) is attraction
    for load in (0.003, 0.01, 0.03):
        found = solve(contact.attraction, load_of(load))
        bonds, gap = contact.attraction.bonds(found.fraction), found.position - HEIGHTS

        def energy_and_gradient(gap, load=load, bonds=bonds):
            pressure = contact.space.pressure(gap.reshape(HEIGHTS.shape) + HEIGHTS)
            energy = 0.5 * np.vdot(gap + HEIGHTS.ravel(), pressure) + np.sum(bonds.energy(bonds.at(gap)))
            residual = pressure.ravel() + load
            residual[bonds.cells] += bonds.tension(bonds.at(gap))
            return energy + load * gap.sum(), residual

        start = np.where(found.held, 0, np.maximum(found.position.mean() - HEIGHTS, 0)).ravel()
        limits, options = [(0, None)] * gap.size, {"maxiter": 5000, "ftol": 1e-16, "gtol": 1e-12, "maxcor": 50}
        best = minimize(energy_and_gradient, start, jac=True, method="L-BFGS-B", bounds=limits, options=options)
        assert gap.mean() == pytest.approx(best.x.mean(), rel=1e-7)
        assert np.abs(gap.ravel() - best.x).max() <= 1e-6 * UNIT
        assert np.array_equal(gap.ravel() == 0, best.x == 0) and (gap == 0).any()


@pytest.mark.parametrize(
    ("attraction", "factors"),
    [
        pytest.param(Cohesive, STRIPES, id="finite range, stripes"),
        pytest.param(ShortRange, UNIFORM, id="short range, uniform"),
        pytest.param(ShortRange, STRIPES, id="short range, stripes"),
    ],
)
def test_pressure_is_the_slope_of_the_energy(attraction, factors):
    """The energy here contains the map: the sum of -dgamma times the adhesive area of each cell."""
    contact = contact_with_factors(attraction, factors)
    law, (below, middle, above) = contact.attraction, np.array([-1e-4, 0, 1e-4]) * UNIT
    first = solve(law, Control(mean=1.2 * UNIT))

    def solve_near(change):
        start, control = (first.position + change, first.fraction), Control(mean=1.2 * UNIT + change)
        return minimise(Problem(contact.space, law, HEIGHTS), *start, control, TOLERANCE)

    def energy(found):
        elastic = 0.5 * np.sum(found.pressure * (HEIGHTS - found.position.mean()))
        fields = found.fraction, average(found.fraction)
        return elastic + np.sum(law.energies(np.arange(GRID**2), *(field.ravel() for field in fields)))

    slope = (energy(solve_near(above)) - energy(solve_near(below))) / (above - below) / GRID**2
    largest = float(np.abs(first.pressure).max())
    assert -slope == pytest.approx(solve_near(middle).load, rel=1e-5, abs=1e-6 * largest)
