"""Unphysical numbers are refused by name; at the ends of their ranges runs are finite or give a reason."""

import numpy as np
import pytest
from few_asperities import HEIGHT, contact_of

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.checks.run import check_run
from icha.contact.model import NotConverged
from icha.path import progress as records
from icha.path.progress import PathProgress

WAVES = np.add.outer(*[np.cos(np.linspace(0, 2 * np.pi, 16, endpoint=False))] * 2)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Surface(1e-6 * WAVES, 1e100), r"^period: 1e\+100 must be a number in \[1e-24, 1e9\]"),
        (lambda: Surface(1e100 * WAVES, 1e-4), r"^heights: their range over the period: .*\[1e-24, 1e9\]"),
        (lambda: Surface(1e-100 * WAVES, 1e-4), r"^heights: their range over the period: .*\[1e-24, 1e9\]"),
        (lambda: Surface(8e307 * WAVES, 1e-4), r"^heights: their range over the period: "),
        (lambda: SelfAffineSpectrum(1e-4, 2e-5, 1e-5, 0.8, 1e-100), r"^rms_slope: 1e-100 must be a number in"),
        (lambda: Material(1e100, 0.0, 1e-9), r"^contact_modulus: 1e\+100 must be a number in \[1e-9, 1e15\]"),
        (lambda: Material(1e6, 1e-300, 1e-9), r"^surface_energy over contact_modulus: 1e-306 must be a number in"),
        (lambda: Material(1e6, 0.1, 1e-100), r"^interaction_range: 1e-100 must be a number in"),
    ],
)
def test_numbers_out_of_range_are_refused_by_name_and_range(make, named):
    with np.errstate(all="raise"), pytest.raises(ValueError, match=named):
        make()


@pytest.mark.parametrize("strength", [0.0, 1e-2])
def test_no_load_is_met_beside_the_lightest_stops(strength):
    surface = Surface(1e-6 * WAVES, 1e-4)
    material = Material(1e6, strength * 1e6 * surface.rms_height**1.5 * surface.rms_curvature**0.5, 1e-8)
    path = Path([1e-10, 1e-3], turning_points=[("reduced_pressure", 0.0)], unload=True)
    run = simulate(surface, material, path)
    turn = run.isel(step=int(np.argmax((run.step_target == 0).values)))
    assert abs(turn.reduced_pressure) <= 1e-8 * run.reduced_pressure.max()
    assert all(check.passed for check in check_run(run))


@pytest.mark.parametrize(
    ("height", "period", "modulus", "strength"),
    [(1e-24, 1e-24, 1e15, 1e-2), (2e8, 1e9, 1e-9, 0.0), (2e8, 1e9, 1e-9, 1e-2)],
)
def test_at_the_ends_of_the_ranges_runs_are_finite_and_pass_their_checks(height, period, modulus, strength):
    surface = Surface(height * WAVES, period)
    energy = strength * modulus * surface.rms_height**1.5 * surface.rms_curvature**0.5
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        for path in (Path([1e-12, 1e-2], unload=True, max_step=0.5), Path(area_fractions=[1e-9, 1e-2])):
            try:
                run = simulate(surface, Material(modulus, energy, 1e-2 * max(height, 1e-22)), path)
            except ConvergenceError as error:
                # With adhesion these surfaces are sticky: the larger area is not reached.
                assert strength and not path.unload and "the surface is sticky" in str(error)
                run = error.dataset
                assert run.sizes["step"] == 1
            assert not [check for check in check_run(run) if not check.passed]


def test_a_path_that_does_not_get_on_ends_and_says_so(monkeypatch):
    monkeypatch.setattr(records, "_MOST_EQUILIBRIA", 10)
    contact = contact_of([HEIGHT])
    state, progress = contact.untouched(), PathProgress(contact, 1, longest=1.0)
    for _ in range(11):
        progress.record_equilibrium(state, loading=True)
    with pytest.raises(NotConverged, match=r"no progress: 10 equilibria within 0\.1 h_rms"):
        progress.record_equilibrium(state, loading=True)
    # A target is progress, and so is a longest step.
    progress.record_target(Path([1e-2]).targets[0], state)
    progress.record_equilibrium(state, loading=True)
    assert progress.idle == 1
