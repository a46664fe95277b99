"""Numbers of the page on pull-off and hysteresis: those of separate asperities, whose loops are exact."""

import re

import numpy as np
import pytest
import separate_asperities as separate
from pages import hysteresis, rules
from write_pages import render

DEPTHS = {"load_1": -0.5, "slopes": 0.0, "load_2": 0.5}


def described(runs):
    """Runs with what the page wants and separate asperities do not have."""
    attrs = {"units": "1", "long_name": "test"}
    return [(labels, run.assign(stickiness=((), 0.5, attrs))) for labels, run in runs]


def by_boundary_elements(runs, pull_off, loss):
    """Runs with adhesion as if by boundary elements, with other pull-off and loss by given factors."""
    return [
        (
            labels._replace(study="truth", model="boundary_elements"),
            run.assign(
                pull_off_pressure=pull_off * run.pull_off_pressure, hysteresis_loss=loss * run.hysteresis_loss
            ).assign_attrs(contact_model="boundary_elements"),
        )
        for labels, run in runs
        if labels.material == "sticky"
    ]


@pytest.fixture(scope="module")
def campaign():
    studies = [described(separate.study(name, depth=depth, slopes=(1.0,))) for name, depth in DEPTHS.items()]
    truth = by_boundary_elements(described(separate.study("slopes", depth=0.0, slopes=(1.0,))), 1.25, 0.8)
    tree = separate.tree(*studies, described(separate.study("other", depth=0.0, slopes=(1.0,))), truth)
    tree.attrs["campaign"] = "test"
    return tree


def of_seeds(quantity, depth, material="sticky"):
    return np.array([float(separate.run(material, 1.0, seed, depth)[quantity]) for seed in (1, 2)])


def written(values, form):
    return f"{form.format(np.mean(values))} ± {form.replace('+', '').format(np.std(values, ddof=1))}"


def test_pull_off_and_loss_are_means_over_the_seeds(campaign):
    head, body = hysteresis.summary(campaign["slopes"].to_dataset())
    assert [row[:2] for row in body] == [["1", "50"]]  # without adhesion there is nothing to pull
    assert body[0][head.index("pull-off, Pa")] == written(of_seeds("pull_off_pressure", 0.0), "{:.3g}")
    loss = of_seeds("hysteresis_loss", 0.0) / separate.MATERIALS["sticky"].surface_energy
    assert body[0][head.index("loss/Δγ")] == written(loss, "{:.4f}")


def test_dependence_on_the_largest_load_is_fitted(campaign):
    studies = [campaign[name].to_dataset() for name in DEPTHS]
    assert hysteresis.common_slope(studies) == 1
    _, (area, loss, pull) = hysteresis.largest_loads(studies)
    assert area[1:2] + loss[1:2] + pull[1:2] == ["A/A₀", "loss/Δγ", "pull-off, Pa"]
    x, y, z = (
        np.array([of_seeds(name, depth).mean() for depth in DEPTHS.values()])
        for name in ("largest_contact_area_fraction", "hysteresis_loss", "pull_off_pressure")
    )
    n, r2 = (float(value) for value in re.findall(r"= ([-\d.]+)", loss[-1]))
    assert n == pytest.approx(np.polyfit(np.log(x), np.log(y), 1)[0], abs=0.006)
    assert r2 == pytest.approx(np.corrcoef(x, y)[0, 1] ** 2, abs=6e-4)
    assert pull[-1] == f"varies by {100 * (z.max() / z.min() - 1):.0f} %"


def test_asperities_are_beside_the_truth(campaign):
    study, truth = (campaign[name].to_dataset() for name in ("slopes", "truth"))
    head, (area, pull, loss) = rules.table(study, truth)
    assert area[:2] == ["1", "50"] and pull[:2] == loss[:2] == ["", ""]
    own = 1.25 * of_seeds("pull_off_pressure", 0.0)
    assert pull[head.index("boundary elements")] == written(own, "{:.3g}")
    assert (area[-1], pull[-1], loss[-1]) == ("+0 ± 0", "-20 ± 0", "+25 ± 0")


def test_the_page_can_be_written(campaign):
    studies = {name: study.to_dataset() for name, study in campaign.children.items()}
    studies |= {"load_control": studies["other"]}
    loads = [studies[name] for name in DEPTHS]
    text = render("hysteresis", campaign=campaign, studies=studies, load_studies=loads, command="make it")
    assert text.startswith("# Pull-off") and "`make it`" in text and "](images/fig13_loops.png)" in text
    assert "nan" not in text.lower() and "{" not in text
