"""Single indenters on a free half-space against exact solutions, at small size (docs/indenter.md: at full)."""

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from icha import Material, Path, SelfAffineSpectrum, Surface
from icha.boundary_elements.contact import contact_of
from icha.contact.model import JUMP_IN, JUMP_OFF
from icha.path.follow import follow
from icha.surfaces.shapes import Sphere
from validation import indenter_contacts as contacts
from validation import rough_indenters


@pytest.mark.parametrize("place", contacts.PLACES)
def test_sphere_without_adhesion_follows_hertz(place):
    row = contacts.hertz(12, place)
    assert abs(row["area_error"]) < 0.01
    assert abs(row["force_error"]) < 1e-3
    assert row["gap_error"] < 1e-3


@pytest.mark.parametrize("control", ["separation", "load"])
def test_sphere_follows_johnson_kendall_and_roberts_in_and_out(control):
    rows = list(contacts.sphere(1 / 6, 64, contacts.PLACES[3], control, 1.0))
    assert min(row["cells"] for row in rows) < 11
    for row in rows:
        if row["cells"] >= 8:
            assert abs(row["force_error"]) <= 0.0125, row
            # Under load, this is an error of the indentation, which changes infinitely fast at pull-off.
            assert abs(row["given_error"]) <= (0.01 if control == "separation" else 0.02), row


def test_sphere_is_pulled_off_at_the_force_of_the_law():
    row = contacts.sphere_pull_off(1 / 6, 48, contacts.PLACES[3])
    assert abs(row["pull_off_error"]) <= 0.005
    assert abs(row["jump_off_error"]) <= 0.02


def test_flat_punch_has_the_stiffness_of_boussinesq_and_the_pull_off_of_kendall():
    """The front has half of its width at a sharp edge: the face seems smaller by 1.2 to 1.5 cells."""
    row = contacts.punch(12, False, 48)
    assert row["stiffness"] == pytest.approx(1, abs=0.01)
    assert 1.2 < 12 * (1 - row["pull_off"] ** (2 / 3)) < 1.5


def test_cone_follows_sneddon_and_maugis():
    for row in contacts.cone(1 / 2, 64):
        if row["cells"] >= 8:
            assert abs(row["force_error"]) < 0.025, row
            assert abs(row["approach_error"]) < 0.01, row


def test_rough_square_without_adhesion_solves_the_dense_problem():
    """Independent solution: least squares without negative pressures, with Love's matrix by Boussinesq's integral."""
    grid, modulus, separation = 20, 3.0, 0.05
    heights = SelfAffineSpectrum(grid, 20.0, 5.0, 0.8, 0.2).realise(grid, 3).heights
    surface = Surface(heights, grid, "free")
    row, column = np.divmod(np.arange(grid**2), grid)
    distances = np.abs(row[:, None] - row), np.abs(column[:, None] - column)
    matrix = _mean_inverse_distance(grid)[distances] / (np.pi * modulus)
    root = cholesky(matrix, lower=True)
    overlap = surface.heights.ravel() - separation
    pressure, _ = nnls(root.T, solve_triangular(root, overlap, lower=True), maxiter=20000)
    contact = contact_of(surface, Material(modulus, 0.0, 1e-3))
    state = contact.equilibrium(contact.untouched(), separation)
    assert 0.05 < np.mean(pressure > 0) < 0.6
    np.testing.assert_array_equal(state.cells % contact.space.grid, column[pressure > 0])
    np.testing.assert_allclose(state.pressure, pressure[pressure > 0], rtol=1e-5, atol=1e-6 * pressure.max())
    gap = matrix @ pressure - overlap
    np.testing.assert_allclose(contact.gap(state).ravel(), gap, atol=1e-6 * np.ptp(heights))


def _mean_inverse_distance(grid):
    """Return the integral of 1/r over a unit square at whole distances from a point, by Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    nodes, weights = nodes / 2, weights / 2
    place = np.arange(grid)
    y, x = place[:, None, None, None] + nodes[:, None], place[:, None, None] + nodes
    with np.errstate(divide="ignore"):
        table = np.sum(weights[:, None] * weights / np.hypot(*np.broadcast_arrays(y, x)), axis=(-2, -1))
    table[0, 0] = 4 * np.arcsinh(1.0)  # exact; quadrature does not resolve the singularity
    return table


def test_sphere_on_a_layer_has_the_limits_of_thick_and_thin():
    for row in rough_indenters.layer_limits(48, (100, 0.1)):
        assert abs(row["force_error"]) < 0.02, row


@pytest.mark.slow
def test_pull_off_of_a_rough_sphere_does_not_depend_on_the_grid():
    coarse, fine = (rough_indenters.rough_loop(grid, (4.0, 2.0)) for grid in (64, 128))
    assert coarse["pull_off"] == pytest.approx(fine["pull_off"], rel=0.02)
    assert coarse["loss"] > 0
    assert not coarse["failed_checks"]


def test_jumps_of_a_lone_patch_release_the_change_of_the_stored_energy():
    """Bonds at the front store energy too; on a layer they store most of the energy of the last patch."""
    surface = Surface(np.zeros((48, 48)), period=0.8, boundary="free", shape=Sphere(1.0))
    layer = Material(1e6, 1e3, interaction_range=1e-4, thickness=0.4, poisson_ratio=0.4)
    contact = contact_of(surface, layer)
    path = Path(indentations=[0.002], unload=True)
    steps = [each.step for each in follow(contact, path) if each.step is not None and len(each.step.events)]
    assert [each.events.kind.tolist() for each in steps] == [[JUMP_IN], [JUMP_OFF]]
    for step in steps:
        assert step.events.energy.sum() / contact.area == pytest.approx(step.loss, rel=1e-2)
