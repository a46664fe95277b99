"""What is expected of the costs of a computation: counts against real surfaces, growth, and what corrects it."""

import math

import numpy as np
import own_slopes_campaign as crops
import pytest

from icha.contact.bins import GAP_BINS, PRESSURE_BINS
from icha.datasets.campaign import campaign_tree
from icha.datasets.labels import count_cells
from icha.planning import costs
from icha.planning.roughness import measured_roughness
from icha.surfaces.moments import spectral_moments, summit_density
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.summits import find_summits

LOADING = costs.Sweep(loads=(1e-3, 3e-3, 1e-2, 3e-2), snapshots=1, adhesion=3e-3)


def rough(grid=256, summits=500, hills=100):
    return costs.Roughness(grid, summits, hills, sharpness=1e-6)


@pytest.mark.parametrize(("hurst", "rolloff", "short"), [(0.8, 20e-6, 3e-6), (0.3, 50e-6, 4e-6), (1.0, 25e-6, 6e-6)])
def test_summits_are_counted_as_on_real_surfaces(hurst, rolloff, short):
    spectrum = SelfAffineSpectrum(100e-6, rolloff, short, hurst)
    by_spectrum = costs.roughness_of(256, 100e-6, *costs.self_affine_moments(100e-6, rolloff, short, hurst))
    expected = by_spectrum.summits
    surfaces = [spectrum.realise(256, seed) for seed in range(4)]
    counted = np.mean([len(find_summits(surface).height) for surface in surfaces])
    # A finite cell has few long waves, and summits scatter as their square root.
    assert expected == pytest.approx(counted, rel=0.15)
    moments = spectral_moments(surfaces[0])
    assert 100e-6**2 * summit_density(moments.m2, moments.m4) == pytest.approx(expected, rel=0.1)
    by_heights = measured_roughness(surfaces[0])
    assert by_heights.summits == len(find_summits(surfaces[0]).height)
    assert by_spectrum.hills == pytest.approx(by_heights.hills, rel=0.25)
    assert by_spectrum.sharpness == pytest.approx(by_heights.sharpness, rel=0.15)


def test_the_spectrum_may_lie_where_its_moments_are_logarithms():
    moments = [costs.self_affine_moments(1.0, 0.2, 0.02, hurst) for hurst in (0.999999, 1.0)]
    values = [costs.roughness_of(256, 1.0, *each).summits for each in moments]
    assert values[0] == pytest.approx(values[1], rel=1e-5)


def test_costs_grow_with_what_is_asked_for():
    def seconds(summits=500, hills=100, **changes):
        surface = rough(summits=summits, hills=hills)
        return costs.sweep_cost(surface, costs.Sweep(**(vars(LOADING) | changes))).seconds

    many = {"loads": tuple(np.geomspace(1e-3, 0.1, 40))}
    # From here on nothing counts but the spots.
    assert seconds(summits=5e6, hills=1e6) > 5 * seconds(summits=5e5, hills=1e5)
    assert costs.spots(rough(hills=400), 0.01) > costs.spots(rough(), 0.01) > costs.spots(rough(), 0.001)
    assert seconds(loads=(1e-3, 0.1)) > seconds(loads=(1e-3, 2e-3))
    assert seconds(**many) > seconds()
    assert seconds(legs=1) > 3 * seconds()
    assert seconds(legs=1) > seconds(legs=1, adhesion=0.0)
    assert seconds(legs=1, max_step=0.01) > seconds(legs=1)
    assert (
        costs.solution_cost(512, 0.01, adhesive=True).seconds > costs.solution_cost(512, 0.01, adhesive=False).seconds
    )
    big, small = costs.surface_cost(8192), costs.surface_cost(1024)
    assert big.disk == pytest.approx(8 * 8192**2, rel=0.01) and big.memory > big.disk > 60 * small.disk
    assert costs.figure_cost(10, 0).seconds < costs.figure_cost(100, 0).seconds < costs.figure_cost(100, 10**8).seconds
    assert costs.figure_cost(10, 10**8, models=2).memory > 3 * costs.figure_cost(10, 10**8).memory
    assert costs.report_cost(10, 2).seconds < costs.report_cost(100, 2).seconds < costs.report_cost(100, 9).seconds


def test_memory_of_a_dataset_is_that_of_its_arrays():
    assert (costs.GAP_EDGES, costs.PRESSURE_EDGES) == (len(GAP_BINS), len(PRESSURE_BINS))
    runs = list(crops.many(20))
    study = campaign_tree(runs)[crops.STUDY].to_dataset()
    sizes = runs[0][1].sizes
    recorded = costs.Recorded(sizes["step"], sizes["snapshot"], sizes["spot"])
    cells = count_cells([labels for labels, _ in runs])
    assert cells == study["status"].size == 60
    expected = costs.dataset_memory(cells, [recorded] * len(runs))
    assert expected == pytest.approx(study.nbytes, rel=0.25)
    # Large arrays stay in the file.
    assert costs.dataset_memory(10**5, [recorded] * 10**5) < 0.5 * 10**5 / cells * expected
    jobs = (
        costs.table_cost(1.0, 1.0, expected),
        costs.figure_cost(60, 0, held=expected),
        costs.report_cost(60, 2, expected),
    )
    without = (costs.table_cost(1.0, 1.0, 0.0), costs.figure_cost(60, 0), costs.report_cost(60, 2))
    for job, bare in zip(jobs, without, strict=True):
        assert job.memory > bare.memory + expected
    assert costs.dataset_cost(1.0, 1.0, 1e9).memory == costs.dataset_cost(1.0, 1.0, 1e12).memory


def test_what_jobs_took_corrects_what_is_expected_of_others():
    assert costs.correction([]) == 1
    assert costs.correction([(1.0, 4.0)]) == pytest.approx(2.0)
    many = [(t, 4 * t) for t in np.linspace(1, 2, 99)]
    assert costs.correction(many) == pytest.approx(4.0, rel=0.02)
    # One job that was slow for a reason of its own does not matter.
    assert costs.correction([*many, (1.0, 1000.0)]) == pytest.approx(4.0, rel=0.02)
    assert math.isclose(LOADING_COST.slower(3).seconds, 3 * LOADING_COST.seconds)
    assert LOADING_COST.slower(3).memory == LOADING_COST.memory


LOADING_COST = costs.sweep_cost(rough(), LOADING)


def test_boundary_elements_grow_with_their_transforms():
    def cost(grid=512, **changes):
        return costs.patch_cost(rough(grid, summits=grid**2 / 500), costs.Sweep(**(vars(LOADING) | changes)))

    fixed = cost(2).seconds
    work = cost(1024).seconds - fixed, cost(512).seconds - fixed
    assert 4 < work[0] / work[1] < 4.6
    assert cost(1024).memory > 1.5 * cost(512).memory
    more = {"loads": tuple(np.geomspace(1e-3, 3e-2, 20))}
    assert cost(adhesion=0.0).seconds < cost().seconds < cost(**more).seconds < cost(**more, legs=1).seconds
    assert cost(adhesion=1e-2).seconds > cost().seconds
    assert cost(max_step=0.05).seconds > cost().seconds and cost(snapshots=4).disk > cost().disk
