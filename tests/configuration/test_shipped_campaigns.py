"""The campaigns, the schema and the tables of keys that are part of the project."""

import numpy as np
import pytest
from demo_configuration import REPOSITORY

from icha.configuration.load import load_configuration
from icha.configuration.schema import json_schema, readme_with_tables
from icha.references.theories import literature
from icha.support.values import Section

SHIPPED = sorted([REPOSITORY / "config/config.yaml", *(REPOSITORY / "config/campaigns").glob("*.yaml")])


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_campaigns_are_valid(path):
    configuration = load_configuration(path)
    campaign = configuration.campaign
    assert campaign.all_runs
    # What a campaign confirms is unusual; comments in its file give the reasons.
    confirmed = [warning.split(": ")[1] for warning in configuration.warnings]
    assert confirmed == campaign.confirmed
    assert path.name == "config.yaml" or campaign.name == path.stem


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
    # The Tabor campaign has the same surface, and Tabor parameters as the names of its materials say.
    tabor = load_configuration(REPOSITORY / "config/campaigns/tabor.yaml").campaign
    assert tabor.surfaces == campaign.surfaces
    found = []
    for name in tabor.studies["tabor"].materials:
        material = tabor.materials[name]
        length = material.surface_energy / material.contact_modulus
        mu = np.cbrt(length**2 * challenge["rms_curvature_radius_m"]) / material.interaction_range
        if name == "adhesionless":
            assert mu == 0
        else:
            assert float(name.removeprefix("mu_").replace("_", ".")) == pytest.approx(mu, rel=2e-3)
            found.append(mu)
    np.testing.assert_allclose(found, np.arange(1, 5.1, 0.5), rtol=2e-3)


def test_schema_and_tables_are_those_of_the_model():
    advice = "out of date: run `make schema`"
    assert (REPOSITORY / "workflow/schemas/config.schema.json").read_text(encoding="utf-8") == json_schema(), advice
    readme = (REPOSITORY / "config/README.md").read_text(encoding="utf-8")
    assert readme == readme_with_tables(readme), advice


def test_every_key_is_described():
    def sections(kind):
        yield kind
        for child in kind.__subclasses__():
            yield from sections(child)

    for section in sections(Section):
        for key, field in section.model_fields.items():
            assert field.description, f"{section.__name__}.{key}"
