"""Section `figures`."""

import pytest

from icha.configuration.errors import ConfigurationError


def test_figures_of_snapshots_need_one(load):
    figures = {"fig3_distributions": {"study": "one"}}
    load({"figures": figures})
    with pytest.raises(ConfigurationError, match=r"fig3_distributions\.study: 'one' keeps no snapshot"):
        load({"figures": figures, "studies.one.snapshots": []})


def test_a_map_shows_the_first_run_with_the_requested_labels(load):
    campaign = load({"figures": {"fig4_contact_map": {"study": "one", "seed": 2, "snapshot": {"area_fraction": 0.02}}}})
    arguments = campaign.campaign.figures.fig4_contact_map.arguments(campaign.campaign)
    assert arguments["run"] == ("one", "asperities", "rough", 2, 0.2, "soft")
    assert arguments["kind"] == "area_fraction" and set(arguments) == {"run", "kind", "target"}


def test_models_are_compared_at_the_same_loads(refused):
    areas = {
        "studies.one.models": ["asperities", "boundary_elements"],
        "studies.one.targets": {"area_fractions": [0.01, 0.02]},
        "figures": {"fig10_model_error": {"study": "one"}},
    }
    refused("", areas, "'one' has no boundary elements at the same loads")
