"""Sampled cases of a campaign: indices of variance against brute force, results along one dimension, words, figures."""

import math

import compared_campaign as compared
import numpy as np
import pytest
from sampled_cases import COUNT, sampled
from scipy import stats
from scipy.stats import qmc, sobol_indices

from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import inputs_study
from icha.datasets.variables.sensitivity import SENSITIVITY
from icha.figures import samples
from icha.path.targets import ESTIMATED_AT_TARGETS, ESTIMATED_OF_LOOPS
from icha.report.answers import distribution_words, samples_table
from icha.uncertainty.distributions import Distribution
from icha.uncertainty.estimates import estimate_campaign
from icha.uncertainty.polynomial_chaos import expand
from icha.uncertainty.sensitivity import sensitivity_of_campaign


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


def test_every_estimated_quantity_has_a_variable():
    assert {*ESTIMATED_AT_TARGETS, *ESTIMATED_OF_LOOPS} <= SENSITIVITY.keys()


def test_cases_without_a_result_do_not_count_and_full_contact_not_for_the_infinite_stiffness():
    runs, samples = sampled()
    failed, full = list(runs), list(runs)
    labels, run = runs[3]
    failed[3] = labels, run.assign_attrs(applicability="the model is not applicable")
    full[3] = labels, run.assign(contact_stiffness=run["contact_stiffness"] * np.inf)
    failed, full = (
        sensitivity_of_campaign(campaign_tree(r), {"one": samples})["one"].to_dataset() for r in (failed, full)
    )
    assert set(failed["case_count"].values) == {COUNT - 1}
    assert np.isnan(failed["contact_area_fraction"].values[0, 0, 3]).all()
    of_stiffness = full["response_quantity"].values == "contact_stiffness"
    assert set(full["case_count"].values[of_stiffness]) == {COUNT - 1} and not np.isinf(full["contact_stiffness"]).any()
    assert set(full["case_count"].values[~of_stiffness]) == {COUNT}
    assert "1 in full contact" in full["left_out"].values[of_stiffness][0]


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


# Five parameters as a tribologist would vary them, and the same distributions of scipy.
PARAMETERS = {
    Distribution("uniform", 0.5, 0.9): stats.uniform(0.5, 0.4),
    Distribution("lognormal", 0.4, 1.3): stats.lognorm(math.log(1.3), scale=0.4),
    Distribution("normal", 2.0, 0.1): stats.norm(2.0, 0.1),
    Distribution("loguniform", 0.7, 0.9): stats.loguniform(0.7, 0.9),
    Distribution("uniform", 0.1, 0.2): stats.uniform(0.1, 0.1),
}
NORMAL = [each.is_normal for each in PARAMETERS]


def quadratic(x):
    """A polynomial of degree two in the standardised parameters, with interactions."""
    hurst, energy, modulus, wave, slope = x
    of_energy, of_wave = np.log(energy), np.log(wave)
    return (
        2 * hurst
        + 0.8 * of_energy
        - 1.5 * modulus
        - 6 * of_wave * hurst
        + 10 * (slope - 0.15) * of_energy
        + 150 * (slope - 0.15) ** 2
    )


def smooth(x):
    """The logarithm of a power law with a threshold, which no polynomial is equal to."""
    hurst, energy, modulus, wave, slope = x
    return np.log(energy**0.3 / (modulus * slope) + 0.2 * np.sqrt(1 + hurst / wave))


def sample(count, seed=1):
    points = qmc.Sobol(len(PARAMETERS), rng=seed).random(count).T
    return np.array([each.quantile(row) for each, row in zip(PARAMETERS, points, strict=True)])


def fit(function, count, noise=0.0, seed=1):
    values = sample(count, seed)
    points = np.column_stack([each.standardise(row) for each, row in zip(PARAMETERS, values, strict=True)])
    return expand(points, NORMAL, function(values) + noise * np.random.default_rng(seed).standard_normal(count))


@pytest.mark.parametrize(("function", "degree", "error"), [(quadratic, 2, 1e-20), (smooth, 2, 2e-2)])
def test_indices_of_64_cases_agree_with_brute_force(function, degree, error):
    found = fit(function, 64)
    assert found.degree == degree and found.error < error
    brute = sobol_indices(func=lambda x: function(x)[None], n=2**14, dists=list(PARAMETERS.values()), rng=1)
    first, total = found.indices(found.coefficients)
    np.testing.assert_allclose(first, np.ravel(brute.first_order), atol=5e-3)
    np.testing.assert_allclose(total, np.ravel(brute.total_order), atol=5e-3)
    assert (total >= first - 1e-12).all() and first.sum() <= 1 + 1e-12


def test_intervals_contain_the_true_indices_in_nine_cases_of_ten():
    truth, _ = fit(quadratic, 64).indices(fit(quadratic, 64).coefficients)
    inside = []
    for seed in range(100):
        found = fit(quadratic, 64, noise=0.1, seed=seed)
        first, _ = found.indices(found.coefficients)
        inside.append(abs(first - truth) <= found.half_widths()[0])
    # The noise itself has a share of the variance, so the indices are slightly too small.
    assert 0.8 < np.mean(inside) < 0.98


def test_main_effects_of_a_sum_are_its_terms():
    found = fit(lambda x: 2 * x[0] + np.log(x[1]), 64)
    hurst = np.array([0.5, 0.7, 0.9])
    effect = found.main_effect(0, next(iter(PARAMETERS)).standardise(hurst), normal=False)
    np.testing.assert_allclose(effect, 2 * hurst + math.log(0.4), rtol=1e-10)
    # Few cases and constant values give no polynomial.
    assert fit(quadratic, 8) is fit(lambda x: np.ones(x.shape[1]), 64) is None


@pytest.mark.parametrize(("ours", "scipys"), PARAMETERS.items(), ids=lambda each: getattr(each, "kind", ""))
def test_quantiles_and_standardised_values_are_those_of_the_distribution(ours, scipys):
    levels = np.linspace(0.01, 0.99, 9)
    values = ours.quantile(levels)
    np.testing.assert_allclose(values, scipys.ppf(levels), rtol=1e-12)
    expected = stats.norm.ppf(levels) if ours.is_normal else 2 * levels - 1
    np.testing.assert_allclose(ours.standardise(values), expected, atol=1e-12)
