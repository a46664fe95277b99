"""Boundary elements in the limit of short range against closed forms, at small size (docs/short_range.md: at full)."""

import numpy as np
import pytest

from validation import single_contacts as contacts

FINE, COARSE = 0.01, 0.025  # asked for from 8 cells of contact radius on, and from 4


def held(rows, *names):
    """Whether all errors of these names are within what is asked for at their contact radius."""
    assert rows
    for row in rows:
        for name in names:
            assert abs(row[name]) <= (FINE if row["cells"] >= 8 else COARSE), row


NODE, MIDDLE, ELSEWHERE = contacts.offsets(3)
# Around a spot with the symmetry of the grid all cells of a ring close at once, and fronts go round in small steps.
LOCKED = pytest.mark.xfail(strict=True, reason="missed where a sphere's centre is a node or in the middle between four")


@pytest.mark.parametrize("offset", [pytest.param(NODE, marks=LOCKED), pytest.param(MIDDLE, marks=LOCKED), ELSEWHERE])
def test_sphere_follows_the_law_of_johnson_kendall_and_roberts(offset):
    rows = list(contacts.sphere_loop(64, offset))
    assert min(row["cells"] for row in rows) < 5 and max(row["cells"] for row in rows) > 14
    held(rows, "area_error", "force_error")


@pytest.mark.parametrize("offset", [NODE, MIDDLE])
def test_sphere_with_the_symmetry_of_the_grid_is_as_right_in_the_mean(offset):
    rows = list(contacts.sphere_loop(64, offset))
    for name in ("area_error", "force_error"):
        assert abs(np.mean([row[name] for row in rows])) <= FINE
        assert max(abs(row[name]) for row in rows) <= 3 * FINE


def test_sphere_under_load():
    held(contacts.sphere_under_load(64, ELSEWHERE), "area_error", "approach_error")


def test_sphere_is_pulled_off_at_the_law_s_force_and_lets_go_where_it_says():
    row = contacts.sphere_pull_off(64, ELSEWHERE)
    held([row], "pull_off_error")
    assert row["jump_off_approach"] == pytest.approx(row["jump_off_approach_exact"], abs=0.05)


def test_sphere_jumps_into_contact_at_wu_s_distance():
    row = contacts.sphere_jump_in(64)
    assert row["approach"] == pytest.approx(row["approach_exact"], abs=1e-9)
    assert (row["spots_before"], row["spots_after"]) == (0, 1)
    assert abs(row["area_error"]) <= COARSE and abs(row["force_error"]) <= COARSE


def test_elliptic_paraboloid_turned_against_the_grid():
    rows = [contacts.ellipse(64, angle, approaches=(1.0, 0.0)) for angle in (0.0, 20.0, 45.0)]
    for same in zip(*rows, strict=True):
        for name in ("area", "pull_off"):
            values = np.array([row[name] for row in same])
            assert np.ptp(values) <= FINE * values.mean()
        forces = np.array([row["force"] for row in same])
        assert np.ptp(forces) <= FINE * same[0]["pull_off"]


def test_wave_from_a_narrow_to_a_wide_contact_and_back():
    rows = contacts.sinusoid(64, 0.3)
    held(rows, "width_error", "pressure_error", "energy_error")


def test_last_gap_in_a_trough_is_a_crack():
    """The closed form leaves out terms of the order of (c/L)^3, 4e-3 for the smallest."""
    rows = list(contacts.crack(96, radii=(0.16, 0.12)))
    held(rows, "radius_error")
    assert abs(rows[-1]["pressure_error"]) <= FINE


def test_compliance_of_an_unbroken_punch_is_that_of_the_circle():
    row = contacts.flat_punch(64, 8)
    assert row["compliance"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_punch_comes_nearer_to_kendall_s_force_on_finer_grids():
    """A front does not move within the sharp edge of a punch, so that its width counts in full."""
    coarse, fine = (1 - contacts.flat_punch(grid, cells)["pull_off"] for grid, cells in ((64, 8), (128, 16)))
    assert 0 < fine < 0.6 * coarse
