"""Key `models` of a study: by which models of contact its runs are computed."""

import pytest

from icha.configuration.cases import run_cases, run_settings, run_sha256
from icha.configuration.errors import ConfigurationError
from icha.planning.plan import RUNS, plan
from icha.planning.requirements import run_memory, run_minutes
from icha.planning.results import campaign_files

BOTH = {"studies.one.models": ["asperities", "boundary_elements"]}
ALONE = {"studies.one.models": ["boundary_elements"]}


def test_without_the_key_runs_are_by_asperities_and_as_they_were(load):
    plain, both = load().campaign, load(BOTH).campaign
    assert {case.model for case in run_cases(plain)} == {"asperities"}
    asperities = [case for case in run_cases(both) if case.model == "asperities"]
    assert asperities == run_cases(plain)
    for case in asperities:
        assert run_settings(both, case) == run_settings(plain, case) and "model" not in run_settings(plain, case)
        assert run_sha256(both, case) == run_sha256(plain, case)


def test_beside_boundary_elements_targets_may_lie_beyond_asperities(load):
    """Asperities end loading at the limit of their range, but they must begin it."""
    beyond = {"studies.one.targets.reduced_pressures": [0.1, 0.5]}
    assert load(BOTH | beyond) and load(ALONE | beyond)
    with pytest.raises(ConfigurationError, match=r"targets\.reduced_pressures\[1\]: 0\.5 is out of range"):
        load(beyond)
    with pytest.raises(ConfigurationError, match=r"targets\.reduced_pressures\[0\]: 0\.2 is out of range"):
        load(BOTH | {"studies.one.targets.reduced_pressures": [0.2, 0.5]})


def test_other_models_have_a_folder_of_their_own(load):
    campaign = load(BOTH).campaign
    paths = [case.path for case in run_cases(campaign)]
    assert paths[0] == "one/rough/seed1/slope0.2/soft" and paths[4] == "one/rough/seed1/slope0.2/boundary_elements/soft"
    assert list(campaign_files(campaign).runs)[-1] == "runs/one/rough/seed2/slope1/boundary_elements/soft.nc"
    assert len({run_sha256(campaign, case) for case in run_cases(campaign)}) == 8


def test_boundary_elements_are_planned_as_a_part_of_their_own_at_their_own_cost(load, tmp_path):
    campaign = load(BOTH | {"surfaces.rough.grid": 512}).campaign
    runs = [item for item in plan(campaign, tmp_path) if item.part == RUNS]
    assert [item.group for item in runs] == 4 * ["study one"] + 4 * ["study one, boundary elements"]
    quick, slow = runs[:4], runs[4:]
    assert min(item.cost.seconds for item in slow) > 2 * max(item.cost.seconds for item in quick)
    first, *_, last = run_cases(campaign)
    assert run_memory(campaign, last) > run_memory(campaign, first)
    assert run_memory(campaign, last) * 1e6 > slow[0].cost.memory
    assert run_minutes(campaign, last) > run_minutes(campaign, first)
