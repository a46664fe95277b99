"""Section `figures`."""

import pytest
from demo_configuration import LONG_RANGE, TRUTH

from icha.configuration.errors import ConfigurationError
from icha.figures.fig4_contact_map import finest_solution


def test_figures_of_snapshots_need_one(load):
    figures = {"fig3_distributions": {"study": "one"}}
    load({"figures": figures})
    with pytest.raises(ConfigurationError, match=r"fig3_distributions\.study: 'one' keeps no snapshot"):
        load({"figures": figures, "studies.one.snapshots": []})


def test_the_figure_of_tabor_parameters_needs_adhesion(load):
    figures = {"fig9_tabor": {"study": "one"}}
    load({"figures": figures})
    with pytest.raises(ConfigurationError, match=r"fig9_tabor\.study: 'one' has no material with adhesion"):
        load({"figures": figures, "materials.soft.surface_energy": "0 J/m^2"})


def test_the_map_is_compared_with_the_finest_solution_of_its_state(load):
    entries = {"coarse": TRUTH, "fine": TRUTH | {"refinement": 2, "seeds": [2]}}
    changes = {**LONG_RANGE, "finite_range": entries}

    def solution(**figure):
        campaign = load({**changes, "figures": {"fig4_contact_map": {"study": "one", **figure}}}).campaign
        return finest_solution(campaign, campaign.figures.fig4_contact_map)

    at_load = {"snapshot": {"reduced_pressure": 0.01}}
    assert solution(**at_load).path == "coarse/rough/seed1/slope0.2/soft/p0.01"
    assert solution(**at_load, seed=2, rms_slope=1.0).path == "fine/rough/seed2/slope1/soft/p0.01"
    assert solution(snapshot={"area_fraction": 0.02}) is None


def test_a_study_of_areas_is_not_said_to_lack_boundary_elements(refused):
    areas = {
        "studies.one.models": ["asperities", "boundary_elements"],
        "studies.one.targets": {"area_fractions": [0.01, 0.02]},
        "figures": {"fig10_model_error": {"study": "one"}},
    }
    refused(
        "", areas, "'one' has boundary elements, but its targets are area_fractions, and errors are compared at the"
    )
