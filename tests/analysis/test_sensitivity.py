"""Sampled cases of a campaign dataset: results along one dimension, indices, words, figures and answers."""

import math

import compared_campaign as compared
import numpy as np
import pytest
from sampled_cases import COUNT, sampled

from icha.analysis.estimates import estimate_campaign
from icha.analysis.sensitivity import sensitivity_of_campaign
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import inputs_study
from icha.figures import samples
from icha.report.answers import distribution_words, samples_table


@pytest.fixture(scope="module")
def tree():
    runs, samples = sampled()
    return sensitivity_of_campaign(campaign_tree(runs), {"one": samples})


def test_results_lie_along_cases_with_the_parameters_as_coordinates(tree):
    data = tree["one"].to_dataset()
    assert data["contact_area_fraction"].dims == ("model", "seed", "case", "target")
    area = data["contact_area_fraction"].isel(model=0, seed=0, target=-1)
    expected = np.exp(data["hurst"]) * np.sqrt(data["surface_energy"] / 0.05)
    ratio = area / expected
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)
    assert data["surface_energy"].attrs["units"] == "J m^-2"
    assert data["surface_energy"].attrs["distribution"] == "lognormal"
    assert data["surface_energy"].attrs["distribution_numbers"].tolist() == [0.05, 1.3]
    words = distribution_words(data, "surface_energy")
    assert words == "surface energy: lognormal, median 50 mJ/m², geometric standard deviation 1.3"


def test_indices_are_those_of_the_known_function(tree):
    data = tree["one"].to_dataset()
    row = data.isel(response=(data["response_quantity"] == "contact_area_fraction").values).isel(response=-1)
    variances = np.array([0.4**2 / 12, (math.log(1.3) / 2) ** 2])
    np.testing.assert_allclose(row["first_order"], variances / variances.sum(), rtol=1e-9)
    np.testing.assert_allclose(row["total_order"], row["first_order"], rtol=1e-9)
    assert float(row["unexplained"]) < 1e-20
    # The area depends on no other parameter, and the gap on none.
    assert set(data["degree"].values[data["response_quantity"] == "mean_gap"]) == {0}


def test_cases_without_a_result_do_not_count():
    runs, samples = sampled()
    runs[3] = runs[3][0], runs[3][1].assign_attrs(applicability="the model is not applicable")
    data = sensitivity_of_campaign(campaign_tree(runs), {"one": samples})["one"].to_dataset()
    assert set(data["case_count"].values) == {COUNT - 1}
    assert np.isnan(data["contact_area_fraction"].values[0, 0, 3]).all()


def test_full_contact_is_left_out_of_the_stiffness_alone():
    """The stiffness of full contact is infinite."""
    runs, samples = sampled()
    runs[3] = runs[3][0], runs[3][1].assign(contact_stiffness=runs[3][1]["contact_stiffness"] * np.inf)
    data = sensitivity_of_campaign(campaign_tree(runs), {"one": samples})["one"].to_dataset()
    of_stiffness = data["response_quantity"].values == "contact_stiffness"
    assert set(data["case_count"].values[of_stiffness]) == {COUNT - 1} and not np.isinf(data["contact_stiffness"]).any()
    assert set(data["case_count"].values[~of_stiffness]) == {COUNT}
    assert "1 in full contact" in data["left_out"].values[of_stiffness][0]


def test_words_and_figures_state_the_indices(tree):
    data = tree["one"].to_dataset()
    table = samples_table(data)
    assert table.head[4:6] == ("Hurst exponent", "surface energy") and tuple(table.rows[-1][4:6]) == ("", "")
    (area,) = (row for row in table.rows if row[0] == "contact area at p* = 0.01")
    assert area[4].startswith("44 ± ") and area[6].endswith(" %") and area[3] in table.as_text()
    panels = samples.sensitivity(tree, study="one").axes
    shown = [bar.get_width() for bar in panels[0].patches]
    np.testing.assert_allclose(shown[:2], [43.65, 56.35], atol=0.1)
    panels = samples.parameters(tree, study="one").axes
    assert [ax.get_xlabel() for ax in panels] == ["$H$", r"$\Delta\gamma$ (mJ/m²)"]
    points, line = (each.get_xydata() for each in panels[0].get_lines())
    assert len(points) == COUNT
    # Averaged over the energy, the logarithm of the area is linear in the exponent.
    assert np.log(line[-1, 1] / line[0, 1]) == pytest.approx(line[-1, 0] - line[0, 0])


def test_the_scatter_of_sampled_parameters_widens_an_answer():
    runs, _ = sampled(inputs_study("one"))
    fine = compared.patches(lambda labels: labels.seed < 3)
    answers = estimate_campaign(campaign_tree([*compared.runs().items(), *fine, *runs]))
    assert list(answers.children) == ["one"]
    study = answers["one"].to_dataset()
    row = study.isel(answer=(study["quantity"] == "contact_area_fraction").values).isel(answer=0)
    areas = np.log([float(run["contact_area_fraction"][0]) for _, run in runs])
    low, high = np.quantile(areas, [0.05, 0.95])
    assert float(row["share_inputs"]) == pytest.approx((high - low) / 2)
    shares = [float(row[f"share_{name}"]) for name in ("seeds", "model", "inputs")]
    assert float(row["estimate_high"] / row["estimate"]) == pytest.approx(1 + math.hypot(*shares))
