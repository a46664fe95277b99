"""Boundary elements both ways: what is lost is what jumps free, and nothing where nothing jumps."""

import numpy as np
import pytest

import icha
from icha.asperity.material import Material
from icha.references.finite_range import GapContact, NotSolved
from icha.references.finite_range_loops import finite_range_loop
from validation.surfaces import paraboloid

ROUGH = icha.SelfAffineSpectrum(period=1.0, rolloff_wavelength=0.5, short_wavelength=0.25, hurst=0.8, rms_slope=0.1)
PERIOD = 8.0


def loop(surface, material, load, step, **given):
    """A loop to a load in units of E* h'rms."""
    settings = {"tolerance": 1e-8} | given
    return finite_range_loop(surface, material, largest_reduced_pressure=load, separation_step=step, **settings)


@pytest.fixture(scope="module")
def without_adhesion():
    return loop(ROUGH.realise(grid=32, seed=1), Material(1.0, 0.0, 1.0), 0.05, 0.05)


@pytest.fixture(scope="module")
def long_range():
    """A range of a third of the paraboloid's height: attraction of so little gradient that nothing snaps."""
    return loop(paraboloid(32, PERIOD), Material(1.0, 1.0, 2.5), 0.02, 0.2)


@pytest.fixture(scope="module")
def snapping():
    """One asperity of Tabor parameter 2."""
    return loop(paraboloid(130, PERIOD), Material(1.0, 1.0, 0.5), 0.0005, 0.2, tolerance=1e-5)


@pytest.mark.parametrize("name", ["without_adhesion", "long_range", pytest.param("snapping", marks=pytest.mark.slow)])
def test_work_is_the_change_of_stored_energy_but_for_losses(request, name):
    """Losses are never negative, by more than the trapezoid's error; the ends differ by the solver's tolerance."""
    ds = request.getfixturevalue(name)
    work, energy = ds.work.values, ds.stored_energy.values
    np.testing.assert_allclose(ds.dissipated, work - energy + energy[0], rtol=0, atol=1e-12 * np.ptp(energy))
    assert np.diff(ds.dissipated).min() > -2e-3 * np.ptp(energy)
    assert abs(energy[-1] - energy[0]) <= float(ds.tolerance) * np.ptp(energy)


def test_loop_without_adhesion_closes(without_adhesion):
    assert abs(without_adhesion.hysteresis_loss) < 1e-4 * without_adhesion.work.max()
    assert without_adhesion.pull_off_pressure == 0
    assert without_adhesion.largest_contact_area_fraction > 0.05


def test_loop_of_a_long_range_closes(long_range):
    """Pressure is the same both ways, where both have a step."""
    down, up = (long_range.isel(step=long_range.leg.values == leg) for leg in (0, 1))
    gaps, first, second = np.intersect1d(
        down.mean_separation.values.round(9), up.mean_separation.values.round(9), return_indices=True
    )
    assert len(gaps) > 10
    strength = float(long_range.surface_energy / long_range.interaction_range)
    there, back = down.nominal_pressure.values[first], up.nominal_pressure.values[second]
    np.testing.assert_allclose(there, back, rtol=0, atol=1e-6 * strength)
    assert abs(long_range.hysteresis_loss) < 1e-3 * np.abs(long_range.work).max()
    assert long_range.pull_off_pressure > 0


@pytest.mark.slow
def test_a_snapping_asperity_loses_its_jumps(snapping):
    """The loss is that of one step in and one step out; the rest of the way is conservative."""
    lost = np.diff(snapping.dissipated)
    out = snapping.leg.values[1:] == 1
    jump_in, jump_off = lost[~out].max(), lost[out].max()
    loss = float(snapping.hysteresis_loss)
    error = float(snapping.hysteresis_loss_error)
    assert min(jump_in, jump_off) > 2 * error
    np.testing.assert_allclose(jump_in + jump_off, loss, rtol=0, atol=error)


@pytest.mark.slow
def test_pull_off_is_near_johnson_kendall_and_roberts(snapping):
    """3/2 pi dgamma R; at a Tabor parameter this low, more, towards the rigid sphere's 2 pi."""
    force = float(snapping.pull_off_pressure) * PERIOD**2
    assert 1.5 * np.pi < force < 2 * np.pi
    assert float(snapping.pull_off_separation) in snapping.mean_separation.values[snapping.leg.values == 1]


def test_a_gap_open_everywhere_is_solved_to_the_law_of_the_interface():
    """Displacement by the attraction, 2/(E* q) mode by mode, and the gap, make the same attraction again."""
    surface, material = paraboloid(48, PERIOD), Material(1.0, 1.0, 1.0)
    contact = GapContact(surface, material, 1e-8)
    separation = float(surface.heights.max()) + 2.0
    contact.start_from(separation - surface.heights)
    state = contact.solve(separation)
    assert state.gap.min() > 0 and state.residual <= 1e-8
    n, k = surface.grid, 2 * np.pi / surface.period
    q = k * np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    q[0, 0] = np.inf
    attraction = -np.exp(-state.gap)
    displacement = np.fft.irfft2(2 / q * np.fft.rfft2(attraction), s=(n, n))
    np.testing.assert_allclose(state.gap, separation + displacement - surface.heights, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "value"), [("largest_reduced_pressure", 0.0), ("separation_step", -0.1), ("tolerance", 0.0)]
)
def test_wrong_values_are_refused_by_name(name, value):
    given = {"largest_reduced_pressure": 0.01, "separation_step": 0.1} | {name: value}
    with pytest.raises(ValueError, match=name):
        finite_range_loop(paraboloid(32, PERIOD), Material(1.0, 1.0, 2.5), **given)


def test_a_load_out_of_reach_says_how_far_it_came():
    with pytest.raises(NotSolved, match=r"loading stopped after mean gap .* h_rms, load .*: the mean gap closed"):
        loop(paraboloid(32, PERIOD), Material(1.0, 0.0, 1.0), 1e3, 0.5)
