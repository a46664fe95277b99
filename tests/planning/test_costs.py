"""Expected costs, compared with measured times and real surfaces."""

import csv
from pathlib import Path

import numpy as np
import own_slopes_campaign as crops
import pytest

from icha.contact.models import DEFAULT_MODEL, MODELS, REFERENCE_MODEL
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.planning import costs
from icha.surfaces.moments import self_affine_moments, summit_density
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.summits import find_summits

SWEEP = {"load": 3e-2, "stops": 4, "snapshots": 1, "adhesive": True}


def test_nine_of_ten_measured_times_are_within_a_factor_of_two():
    ratios = {}
    with (Path(__file__).parent / "measured_times.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            kind, measured = row.pop("kind"), float(row.pop("seconds"))
            quantities = {name: float(value) for name, value in row.items() if name != "group" and value}
            if "summits" in quantities:
                quantities["spots"] = costs.spots(quantities.pop("summits"), quantities["load"])
            model, *words = kind.split(", ")
            expected = costs.run_seconds(model, adhesive="adhesion" in words, loop="cycle" in words, **quantities)
            # `others` are cases that no law was fitted to; the `large` ones are those of docs/benchmarks.md.
            ratios.setdefault(row["group"], []).append(expected / measured)
            ratios.setdefault("all", []).append(expected / measured)
    assert len(ratios["all"]) > 190
    for group, least in {"all": 0.95, "fitted": 0.95, "others": 0.9, "large": 0.85, "few spots": 0.85}.items():
        within = np.mean([0.5 <= ratio <= 2 for ratio in ratios[group]])
        assert within >= least, group


@pytest.mark.parametrize(("hurst", "rolloff", "short"), [(0.8, 20e-6, 3e-6), (0.3, 50e-6, 4e-6), (1.0, 25e-6, 6e-6)])
def test_summits_are_counted_as_on_real_surfaces(hurst, rolloff, short):
    moments = self_affine_moments(100e-6, rolloff, short, hurst)
    expected = 100e-6**2 * summit_density(moments.m2, moments.m4)
    spectrum = SelfAffineSpectrum(100e-6, rolloff, short, hurst)
    counted = np.mean([len(find_summits(spectrum.realise(256, seed)).height) for seed in range(4)])
    # A finite cell has few long waves, and summits scatter as their square root.
    assert expected == pytest.approx(counted, rel=0.15)
    # The moments of hurst = 1 are logarithms.
    near = self_affine_moments(100e-6, rolloff, short, hurst - 1e-6)
    assert near == pytest.approx(moments, rel=1e-4)


@pytest.mark.parametrize("model", [DEFAULT_MODEL, REFERENCE_MODEL])
def test_costs_grow_with_what_is_asked_for(model):
    def cost(grid=512, summits=500, **changes):
        return costs.run_cost(model, grid, summits, **(SWEEP | changes))

    assert cost(summits=5000).seconds > cost().seconds
    assert cost(load=0.1).seconds > cost().seconds
    assert cost(legs=3).seconds > cost(legs=1).seconds > 3 * cost().seconds
    # On large grids, measured loops of boundary elements take about as long without adhesion.
    assert MODELS[model].by_cells or cost(legs=1).seconds > cost(legs=1, adhesive=False).seconds
    sticky = cost(energy_ratio=0.138).seconds / cost(energy_ratio=10.0).seconds
    assert 10 < sticky < 30 if MODELS[model].by_cells else sticky == 1
    assert cost(legs=1, max_step=0.01).seconds > cost(legs=1).seconds
    # Transforms of a free square are larger, which takes longer in loops of boundary elements with adhesion.
    loops = cost(legs=1, free=True).seconds / cost(legs=1).seconds
    assert loops > 3 if MODELS[model].by_cells else loops == 1
    assert cost(free=True).seconds == cost().seconds
    assert cost(grid=1024).memory >= cost().memory + 8 * (1024**2 - 512**2)
    assert cost(snapshots=9).disk > cost().disk
    assert cost(summits=0).seconds > 0  # a saddle has none


def test_maps_take_the_memory_of_their_topography():
    assert costs.figure_cost(0.0, 10**8).memory - costs.figure_cost(0.0, 0).memory == pytest.approx(56e8)
    big = costs.surface_cost(8192)
    assert big.disk == pytest.approx(8 * 8192**2, rel=0.01) and big.memory > big.disk


def test_memory_of_a_dataset_is_estimated_from_the_files_of_its_runs(tmp_path):
    runs = list(crops.many(20))
    arrays = campaign_tree(runs)[crops.STUDY].to_dataset().nbytes
    write_dataset(runs[0][1], tmp_path / "run.nc")
    values = len(runs) * ((tmp_path / "run.nc").stat().st_size - 53e3)
    memory = costs.analysis_cost(1.0, values).memory - costs.analysis_cost(1.0, 0.0).memory
    # Reading and using a dataset takes 2.7 times its arrays.
    assert memory == pytest.approx(2.7 * arrays, rel=0.5)


def test_what_jobs_took_corrects_what_is_expected_of_others():
    assert costs.correction([(1.0, 4.0)]) == pytest.approx(2.0)
    many = [(t, 4 * t) for t in np.linspace(1, 2, 99)]
    assert costs.correction(many) == pytest.approx(4.0, rel=0.02)
    # A single slow job has no effect.
    assert costs.correction([*many, (1.0, 1000.0)]) == pytest.approx(4.0, rel=0.02)
