"""The campaigns that are part of the project."""

import numpy as np
import pytest
from demo_configuration import REPOSITORY

from icha.configuration.cases import run_cases, run_settings, surface_cases
from icha.configuration.load import load_configuration
from icha.contact.models import DEFAULT_MODEL
from icha.planning.results import campaign_files
from icha.references.theories import literature

SHIPPED = sorted([REPOSITORY / "config/config.yaml", *(REPOSITORY / "config/campaigns").glob("*.yaml")])


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_campaigns_are_valid(path):
    configuration = load_configuration(path)
    campaign = configuration.campaign
    assert run_cases(campaign)
    # What a campaign confirms is unusual; comments in its file give the reasons.
    confirmed = [warning.split(": ")[1] for warning in configuration.warnings]
    assert confirmed == campaign.confirmed
    assert path.name == "config.yaml" or campaign.name == path.stem


def test_the_papers_campaign():
    campaign = load_configuration(REPOSITORY / "config/config.yaml").campaign
    assert campaign.name == "paper"
    asperities = [case for case in run_cases(campaign) if case.model == DEFAULT_MODEL]
    assert len(asperities) == 2 + 9 + 12
    assert [(name, seed) for name, seed in surface_cases(campaign) if seed == 1][:2] == [
        ("challenge", 1),
        ("mcghee", 1),
    ]
    assert campaign.resolution("challenge").cells == pytest.approx(8)
    ratios = [m.surface_energy / m.contact_modulus for m in campaign.materials.values()][2:]
    assert ratios == pytest.approx([8.333e-9, 4.0e-9, 1.905e-9], rel=1e-3)
    # Boundary elements solve the paper's material, and none, at the same loads with the same snapshots.
    compared = [case for case in campaign_files(campaign).compared.values() if case.study == "challenge"]
    assert {campaign.materials[case.material].surface_energy for case in compared} == {0.05, 0.0}
    for case in compared:
        path = run_settings(campaign, case)["path"]
        assert path == run_settings(campaign, case._replace(model=DEFAULT_MODEL))["path"]
        assert path["snapshots"] == [("reduced_pressure", p) for p in path["reduced_pressures"]]


def test_the_whole_challenge():
    challenge = literature("contact_mechanics_challenge")
    campaign = load_configuration(REPOSITORY / "config/campaigns/cmc_full.yaml").campaign
    surface, study = campaign.surfaces["challenge"], campaign.studies["challenge"]
    for name in ("period", "rolloff_wavelength", "short_wavelength"):
        assert getattr(surface, name) == pytest.approx(challenge[f"{name}_m"])
    assert (surface.hurst, study.rms_slopes) == (challenge["hurst"], [challenge["rms_slope"]])
    assert campaign.resolution("challenge").cells >= 8
    cmc = campaign.materials["cmc"]
    constants = [cmc.contact_modulus, cmc.surface_energy, cmc.interaction_range]
    assert constants == [challenge[key] for key in ("contact_modulus_Pa", "surface_energy_J_m2", "interaction_range_m")]
    pressure = challenge["reference_pressure_Pa"] / challenge["contact_modulus_Pa"] / challenge["rms_slope"]
    assert [snapshot.kind_and_value for snapshot in study.snapshots] == [("reduced_pressure", pytest.approx(pressure))]


def test_tabor_parameters_of_the_tabor_campaign():
    challenge = literature("contact_mechanics_challenge")
    campaign = load_configuration(REPOSITORY / "config/campaigns/tabor.yaml").campaign
    whole = load_configuration(REPOSITORY / "config/campaigns/cmc_full.yaml").campaign
    assert campaign.surfaces == whole.surfaces
    found = []
    for name in campaign.studies["tabor"].materials:
        material = campaign.materials[name]
        length = material.surface_energy / material.contact_modulus
        mu = np.cbrt(length**2 * challenge["rms_curvature_radius_m"]) / material.interaction_range
        if name == "adhesionless":
            assert mu == 0
        else:
            assert float(name.removeprefix("mu_").replace("_", ".")) == pytest.approx(mu, rel=2e-3)
            found.append(mu)
    np.testing.assert_allclose(found, np.arange(1, 5.1, 0.5), rtol=2e-3)
