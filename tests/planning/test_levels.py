"""Choice of the seeds of a study with `accuracy`: budget, the level without use, errors of the grid; the file."""

import math

import numpy as np
import xarray as xr

from icha.configuration.load import load_configuration
from icha.configuration.studies import PILOT, Study
from icha.planning.levels import choose_for_study, words_of_levels, write_levels
from icha.uncertainty.control_variates import quantile

COSTS = {"asperities": 1.0, "coarse": 4.0, "fine": 20.0}


def estimate(*, seeds, model, refinement, grid=0.0, asperities=8, quantity="contact_area_fraction"):
    """One answer of a pilot with 8, 6 and 4 seeds; the arguments are standard deviations of the parts of the mean."""
    half = quantile(3.0)
    shares = {"seeds": half * seeds, "model": half * model, "refinement": half * refinement, "grid": grid}
    values = {f"share_{name}": share for name, share in shares.items()} | {
        "quantity": quantity,
        "estimate": 0.01,
        "estimate_high": 0.01 * math.exp(math.hypot(*shares.values())),
        "degrees_of_freedom": 3.0,
        "asperity_seeds": asperities,
        "coarse_seeds": 6,
        "fine_seeds": 4,
    }
    answer = xr.Dataset({name: ("answer", [value]) for name, value in values.items()})
    return xr.DataTree.from_dict({"/load": answer})


def choice(accuracy, with_asperities, without, cores=1):
    study = Study(targets={"reduced_pressures": [0.01]}, accuracy=accuracy)
    return choose_for_study("load", study, [with_asperities, without], COSTS, cores)


# Asperities with much scatter that follow the coarse grid closely, and the same without the asperities.
THREE = estimate(seeds=0.1, model=0.01, refinement=0.005)
TWO = estimate(seeds=0.12, model=0.0, refinement=0.005, asperities=0)


def test_the_cheapest_levels_that_reach_the_accuracy_are_chosen():
    found = choice("4 %", THREE, TWO)
    assert [*found.counts] == ["asperities", "coarse", "fine"] and found.reason == ""
    assert found.counts["asperities"] > 100 and found.counts["fine"] == 4  # the pilot has four
    assert found.seconds == sum(COSTS[level] * count for level, count in found.counts.items())
    # If the asperities do not follow the coarse grid, their level is left out.
    useless = estimate(seeds=0.1, model=0.12, refinement=0.005)
    assert [*choice("4 %", useless, TWO).counts] == ["coarse", "fine"]


def test_a_study_that_is_accurate_enough_needs_no_seeds():
    assert choice("30 %", THREE, TWO).counts == {}
    assert choice("30 %", THREE, TWO).sentence == "contact area ± 24 % (30 % required)"
    # If areas are targets, the pressure is the result.
    study = Study(targets={"area_fractions": [0.01]}, accuracy="4 %")
    pressure = estimate(seeds=0.1, model=0.01, refinement=0.005, quantity="nominal_pressure")
    assert choose_for_study("load", study, [pressure, pressure], COSTS, 1).quantity == "nominal_pressure"


def test_a_budget_on_more_cores_allows_more_seeds():
    unlimited = choice("3 %", THREE, TWO)
    counts = {}
    for cores in (1, 2):
        found = choice({"half_width": "3 %", "budget": "150 s"}, THREE, TWO, cores)
        assert found.reason == "the budget does not suffice" and found.seconds <= 150 * cores < unlimited.seconds
        counts[cores] = found.counts["asperities"]
    assert counts[1] < counts[2] < unlimited.counts["asperities"]
    nothing = choice({"half_width": "4 %", "budget": "1 s"}, THREE, TWO)
    assert nothing.counts == {} and nothing.reason == "the budget does not suffice"


def test_reasons_why_an_accuracy_cannot_be_reached():
    found = choice("4 %", estimate(seeds=0.1, model=0.01, refinement=0.005, grid=0.05), TWO)
    assert found.counts and not found.reason  # the estimate without asperities has another error of the grid
    coarse = estimate(seeds=0.1, model=0.01, refinement=0.005, grid=0.05)
    found = choice("4 %", coarse, coarse)
    assert found.counts == {} and found.reason.startswith("the error of the grid is ± 5 %; expected a finer grid")
    other = estimate(seeds=0.1, model=0.01, refinement=0.005, quantity="mean_gap")
    found = choice("4 %", other, other)
    assert not np.isfinite(found.half_width) and "no run has a result for contact_area_fraction" in found.reason


def test_written_levels_replace_the_pilot_and_are_in_the_configuration_as_used(load, tmp_path):
    study = {"surfaces": ["rough"], "rms_slopes": [1], "materials": ["soft"]}
    study |= {"targets": {"reduced_pressures": [0.01]}, "accuracy": "3 %"}

    def read(**changes):
        both = {"studies": {name: study | changes for name in ("one", "two")}}
        return load(both | {"materials.soft.surface_energy": "0 J/m^2"}, results=tmp_path / "results")

    assert all(read().campaign.studies[name].seeds_of_levels == PILOT for name in ("one", "two"))
    results = tmp_path / "results/demo"
    results.mkdir(parents=True)
    chosen = choice("4 %", THREE, TWO)
    write_levels(results, {"one": chosen})
    write_levels(results, {"two": chosen._replace(counts={"coarse": 9, "fine": 3})})
    configuration = read()
    campaign = configuration.campaign
    assert len(campaign.studies["one"].seeds) == chosen.counts["asperities"]
    assert campaign.studies["two"].models == ["boundary_elements"] and campaign.studies["two"].seeds == [1, 2, 3]
    assert "levels:\n      coarse: 1..9\n      fine: 1..3\n" in configuration.text
    # The text is complete: it gives the same campaign without the folder of results.
    (tmp_path / "used.yaml").write_text(configuration.text)
    assert load_configuration(tmp_path / "used.yaml").campaign == campaign
    # Without the key, the file has no effect.
    plain = read(accuracy=None).campaign
    assert plain.studies["one"].levels is None


def test_levels_in_words():
    assert words_of_levels({"coarse": 9, "fine": 1}) == (
        "9 seeds of boundary elements on half the grid, 1 seed of boundary elements"
    )
