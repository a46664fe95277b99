"""The error of the limit of a short range: against the equations of Maugis, solved here."""

import numpy as np
import pytest

from icha.asperity.tabor import describe_short_range, sphere_pull_off_factor


def exact_pull_off_factor(tabor_parameter):
    """Solve Maugis's equations for the contact radius a at ratios m = c/a of both radii; return the largest tension."""
    parameter = 1.157 * tabor_parameter
    m = 1 + np.geomspace(1e-5, 1e4, 200_001)
    root, angle = np.sqrt(m**2 - 1), np.arctan(np.sqrt(m**2 - 1))
    square = parameter / 2 * (root + (m**2 - 2) * angle)
    linear = 4 / 3 * parameter**2 * (root * angle - m + 1)
    a = (np.sqrt(linear**2 + 4 * square) - linear) / (2 * square)
    return -np.min(a**3 - parameter * a**2 * (root + m**2 * angle))


@pytest.mark.parametrize("tabor_parameter", [0.03, 0.1, 0.344, 1.0, 3.0, 10.0])
def test_pull_off_forces_are_those_of_maugis(tabor_parameter):
    assert sphere_pull_off_factor(tabor_parameter) == pytest.approx(exact_pull_off_factor(tabor_parameter), rel=2e-4)


def test_limits_are_rigid_and_soft_spheres():
    assert sphere_pull_off_factor(1e-6) == pytest.approx(2.0) and sphere_pull_off_factor(1e6) == pytest.approx(1.5)
    assert describe_short_range(3.0) == ""
    # A glass bead of 10 um with 50 mJ/m^2 and a range of 0.5 nm.
    assert "is 1.76 pi dgamma R by the theory of Maugis, 18 % more than for a short range" in describe_short_range(
        0.344
    )
