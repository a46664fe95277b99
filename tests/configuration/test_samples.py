"""Key `sample` of a study: cases drawn from distributions."""

import numpy as np
import pytest
from scipy.stats import kstest, lognorm, norm, uniform

from icha.configuration.cases import run_cases, run_settings, surface_settings
from icha.configuration.design import sampled_parameters, varied_values
from icha.configuration.errors import ConfigurationError
from icha.datasets.labels import inputs_study

PARAMETERS = {
    "hurst": [0.5, 0.9],
    "surface_energy": {"lognormal": ["20 mJ/m^2", 1.3]},
    "contact_modulus": {"normal": ["25 MPa", "1 MPa"]},
}
SAMPLE = {"count": 64, "parameters": PARAMETERS}
ONE = {"studies.one.seeds": [1, 2], "studies.one.rms_slopes": [0.5], "studies.one.sample": SAMPLE}


def drawn(campaign, label="one"):
    cases, parameters = sampled_parameters(campaign)[label]
    return cases, {name: np.array(each[4]) for name, each in parameters.items()}


def test_each_case_is_a_contact_with_the_values_drawn(load):
    campaign = load(ONE).campaign
    cases, values = drawn(campaign)
    runs = run_cases(campaign)
    assert len(cases) == 64 and len(runs) == 128
    assert runs[0].path == "one/rough-one-case0/seed1/slope0.5/soft-one-case0"
    for k in (0, 17, 63):
        run = next(run for run in runs if (run.surface, run.rms_slope, run.material) == cases[k])
        assert surface_settings(campaign, run.surface)["hurst"] == values["hurst"][k]
        material = run_settings(campaign, run)["material"]
        assert material["surface_energy"] == pytest.approx(values["surface_energy"][k], rel=1e-15)
        assert material["contact_modulus"] == pytest.approx(values["contact_modulus"][k], rel=1e-15)
    assert varied_values(campaign)["one"]["hurst"][2]["rough-one-case17"] == values["hurst"][17]


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_values_have_their_distributions_and_depend_on_the_seed_alone(load, method):
    sample = SAMPLE | {"method": method}
    _, values = drawn(load(ONE | {"studies.one.sample": sample}).campaign)
    for name, expected in (
        ("hurst", uniform(0.5, 0.4)),
        ("surface_energy", lognorm(np.log(1.3), scale=0.02)),
        ("contact_modulus", norm(25e6, 1e6)),
    ):
        # A sample of independent values would differ by 0.1.
        assert kstest(values[name], expected.cdf).statistic < 0.04
    turned = sample | {"parameters": dict(reversed(PARAMETERS.items()))}
    assert drawn(load(ONE | {"studies.one.sample": turned}).campaign)[1]["hurst"].tolist() == values["hurst"].tolist()
    other = drawn(load(ONE | {"studies.one.sample": sample | {"seed": 2}}).campaign)[1]
    assert other["hurst"].tolist() != values["hurst"].tolist()


def test_rms_slopes_can_be_sampled(load):
    sample = {"count": 4, "parameters": {"rms_slope": [0.2, 0.4]}}
    campaign = load(ONE | {"studies.one.rms_slopes": None, "studies.one.sample": sample}).campaign
    cases, values = drawn(campaign)
    assert [slope for _, slope, _ in cases] == values["rms_slope"].tolist()
    assert {surface for surface, _, _ in cases} == {"rough"} and len(run_cases(campaign)) == 8


def test_beside_levels_the_sample_is_a_study_of_its_own(load):
    changes = ONE | {"studies.one.seeds": None, "surfaces.rough.grid": 96}
    changes |= {"studies.one.levels": {"asperities": "1..4", "coarse": "1..3", "fine": "1..2"}}
    campaign = load(changes).campaign
    runs = run_cases(campaign)
    own = [run for run in runs if run.study == "one"]
    assert {(run.surface, run.material) for run in own} == {("rough", "soft")} and len(own) == 6
    inputs = [run for run in runs if run.study == inputs_study("one")]
    assert len(inputs) == 64 and {(run.model, run.seed) for run in inputs} == {("asperities", 1)}
    assert list(sampled_parameters(campaign)) == ["one-inputs"]


def test_a_draw_that_is_impossible_is_named(load):
    sample = {"count": 64, "parameters": {"hurst": {"normal": [0.8, 0.2]}}}
    with pytest.raises(ConfigurationError) as error:
        load(ONE | {"studies.one.sample": sample})
    assert "studies.one.sample.parameters.hurst: 1." in str(error.value)
    assert "is out of range in case" in str(error.value)
