"""What is expected of the costs of a computation: counts against real surfaces, growth, and what corrects it."""

import math

import numpy as np
import pytest

from icha.planning import costs
from icha.surfaces.moments import spectral_moments
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.summits import find_summits

LOADING = costs.Sweep(stops=10, snapshots=1, largest_load=0.03, adhesive=True)


@pytest.mark.parametrize(("hurst", "rolloff", "short"), [(0.8, 20e-6, 3e-6), (0.3, 50e-6, 4e-6), (1.0, 25e-6, 6e-6)])
def test_summits_are_counted_as_on_real_surfaces(hurst, rolloff, short):
    spectrum = SelfAffineSpectrum(100e-6, rolloff, short, hurst)
    expected = costs.self_affine_summits(100e-6, rolloff, short, hurst)
    surfaces = [spectrum.realise(256, seed) for seed in range(4)]
    counted = np.mean([len(find_summits(surface).height) for surface in surfaces])
    # A finite cell has few long waves, and summits scatter as their square root.
    assert expected == pytest.approx(counted, rel=0.15)
    moments = spectral_moments(surfaces[0])
    assert costs.gaussian_summits(100e-6, moments.m2, moments.m4) == pytest.approx(expected, rel=0.1)


def test_the_spectrum_may_lie_where_its_moments_are_logarithms():
    values = [costs.self_affine_summits(1.0, 0.2, 0.02, hurst) for hurst in (0.999999, 1.0)]
    assert values[0] == pytest.approx(values[1], rel=1e-5)


def test_costs_grow_with_what_is_asked_for():
    def seconds(summits=500, **changes):
        return costs.sweep_cost(256, summits, costs.Sweep(**(vars(LOADING) | changes))).seconds

    assert seconds(summits=5000) > 5 * seconds() - costs.JOB_SECONDS * 5
    assert seconds(largest_load=0.1) > seconds(largest_load=0.001)
    assert seconds(stops=40) > seconds(stops=4)
    assert seconds(legs=1) > 3 * seconds()
    assert seconds(legs=1, adhesive=True) > seconds(legs=1, adhesive=False)
    assert seconds(max_step=0.01) > seconds()
    assert (
        costs.solution_cost(512, 0.01, adhesive=True).seconds > costs.solution_cost(512, 0.01, adhesive=False).seconds
    )
    big, small = costs.surface_cost(8192), costs.surface_cost(1024)
    assert big.disk == pytest.approx(8 * 8192**2, rel=0.01) and big.memory > big.disk > 60 * small.disk


def test_what_jobs_took_corrects_what_is_expected_of_others():
    assert costs.correction([]) == 1
    assert costs.correction([(1.0, 4.0)]) == pytest.approx(2.0)
    many = [(t, 4 * t) for t in np.linspace(1, 2, 99)]
    assert costs.correction(many) == pytest.approx(4.0, rel=0.02)
    # One job that was slow for a reason of its own does not matter.
    assert costs.correction([*many, (1.0, 1000.0)]) == pytest.approx(4.0, rel=0.02)
    assert math.isclose(LOADING_COST.slower(3).seconds, 3 * LOADING_COST.seconds)
    assert LOADING_COST.slower(3).memory == LOADING_COST.memory


LOADING_COST = costs.sweep_cost(256, 500, LOADING)


def test_boundary_elements_grow_with_their_transforms():
    def cost(grid=512, **changes):
        return costs.patch_cost(grid, 500, costs.Sweep(**(vars(LOADING) | changes)))

    work = cost(1024).seconds - costs.JOB_SECONDS, cost(512).seconds - costs.JOB_SECONDS
    assert 4 < work[0] / work[1] < 4.6
    assert cost(1024).memory > 1.5 * cost(512).memory
    assert cost(adhesive=False).seconds < cost().seconds < cost(stops=20).seconds < cost(stops=20, legs=1).seconds
    assert cost(max_step=0.05).seconds > cost().seconds and cost(snapshots=4).disk > cost().disk
