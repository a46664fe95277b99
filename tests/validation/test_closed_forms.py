"""Closed forms of the limit of short range against Fourier sums, quadrature, energy, and limits; jumps into contact."""

import re

import numpy as np
import pytest
from conftest import REPOSITORY
from scipy.integrate import quad

from icha import Material
from icha.asperity.jkr import JKR, wu_gap
from icha.asperity.material import WU_HOLDS_FROM
from icha.half_space.interaction import displacement_at
from validation.closed_forms import (
    IMAGES_CUBED,
    CrackInTrough,
    Sinusoid,
    SphereInCell,
    intensity_at_equilibrium,
    punch_displacement,
)

SOFT = Material(2.0, 0.3, 1e-3)
BARE = Material(2.0, 0.0, 1e-3)


def slope(function, x, step=1e-6):
    return (function(x + step) - function(x - step)) / (2 * step)


# --- flat punches ------------------------------------------------------------------------------------------------


def test_images_of_a_round_punch_are_those_of_a_sphere_without_curvature():
    a, R = np.array([0.3]), np.array([1e9])
    one = np.zeros((1, 2))
    force = float(JKR(SOFT).force(a, R)[0])
    at_centre = displacement_at(JKR(SOFT), 8.0, one, one, a, R)[0]
    # The centre is displaced by the second moments of the images, the punch in the mean by their curvature as well.
    single = force / (2 * SOFT.contact_modulus * 0.3)
    bend = force * IMAGES_CUBED / 8.0**3 * 0.3**2 / 6 / (np.pi * SOFT.contact_modulus)
    assert at_centre - single + bend == pytest.approx(punch_displacement(SOFT, 0.3, force, 8.0) - single, rel=1e-6)


# --- the sinusoid ------------------------------------------------------------------------------------------------


@pytest.fixture(params=[0.0, 0.05, 0.3])
def wave(request):
    amplitude, L, E = 0.02, 1.3, 2.0
    energy = (request.param * np.pi * E * amplitude / L) ** 2 * L / (2 * E)
    return Sinusoid(Material(E, energy, 1e-3), amplitude, L)


PSI = np.linspace(0.2, 1.5, 14)


def test_pressure_is_minus_the_derivative_of_the_energy(wave):
    """Along the equilibria the energy is stationary in the contact at a given separation."""
    for psi in PSI:
        assert slope(wave.stored_energy, psi) == pytest.approx(
            -wave.pressure(psi) * slope(wave.separation, psi), rel=1e-6, abs=1e-9
        )


# --- the crack ---------------------------------------------------------------------------------------------------


def test_crack_in_a_trough_by_quadrature():
    crack, c = CrackInTrough(SOFT, 0.03, 5.0), 0.4
    q, p = 2 * np.pi / 5.0, crack.pressure(0.4)

    def tension(r):  # azimuthal mean of minus the pressure in full contact
        around = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        return crack.tearing * np.mean(np.cos(q * r * np.cos(around)) + np.cos(q * r * np.sin(around))) / 2 - p

    assert crack.tearing == pytest.approx(SOFT.contact_modulus * q / 2 * 0.03)
    # r = c sin t
    root = quad(lambda t: tension(c * np.sin(t)) * c * np.sin(t), 0, np.pi / 2)[0]
    assert 2 / np.sqrt(np.pi * c) * root == pytest.approx(intensity_at_equilibrium(SOFT))
    volume = 8 / SOFT.contact_modulus * quad(lambda r: tension(r) * r * np.sqrt(c**2 - r**2), 0, c)[0]
    assert volume / 25 == pytest.approx(crack.separation(c))


# --- the sphere in its cell --------------------------------------------------------------------------------------


@pytest.mark.parametrize("material", [SOFT, BARE], ids=["adhesive", "hard"])
def test_images_of_the_sphere_displace_its_centre_as_in_the_model(material):
    R, L, a = 2.0, 12.0, 1.1
    cell = SphereInCell(material, R, L)
    effective = cell._curvature_radius(a)
    one, radius, curvature = np.zeros((1, 2)), np.array([a]), np.array([effective])
    centre = displacement_at(JKR(material), L, one, one, radius, curvature)[0]
    assert cell.approach(a) == pytest.approx(centre, rel=1e-5)


def test_images_of_the_sphere_bend_the_half_space_under_it():
    R, L, a = 2.0, 12.0, 1.1
    law, cell = JKR(BARE), SphereInCell(BARE, R, L)
    one, radius, curvature = np.zeros((1, 2)), np.array([a]), np.array([cell._curvature_radius(a)])
    x = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.35, 0.35]])
    total = displacement_at(law, L, x, one, radius, curvature)
    # Contact means that displacement follows the sphere's own shape.
    drop = total[0] - total[1:]
    np.testing.assert_allclose(drop, np.sum(x[1:] ** 2, axis=1) / (2 * R), rtol=1e-4)


# --- jumps into contact ------------------------------------------------------------------------------------------


def test_wu_holds_from_where_the_models_say():
    """The table of the page has the exact gaps."""
    text = (REPOSITORY / "docs/model.md").read_text()
    rows = re.findall(r"^\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) % \|$", text, flags=re.MULTILINE)
    assert len(rows) == 8
    for tabor_parameter, *numbers in rows:
        exact, written, percent = map(float, numbers)
        wu = wu_gap(float(tabor_parameter))
        error = wu / exact - 1
        assert wu == pytest.approx(written, abs=5.1e-5)
        assert 100 * error == pytest.approx(percent, abs=0.0051 if percent > 0.1 else 2e-3)
        assert 0 < error < 0.005 or float(tabor_parameter) < WU_HOLDS_FROM
