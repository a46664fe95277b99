"""The error of the asperity model in words."""

import compared_campaign as compared
import numpy as np
import pytest

from icha.analysis.measured_error import _range, measured_errors
from icha.analysis.model_error import model_error


def test_the_error_of_each_study_is_stated_with_its_range_and_its_size():
    truths = compared.patches(area=1.25, separation=0.8)
    errors = model_error(compared.tree_of_both(), truths)
    (statement,) = measured_errors(errors).values()
    assert statement.about == "error" and statement.text == (
        "of the asperity model in study one: contact area 20 to 20 % too small, mean separation 25 to 25 % too large "
        "(3 seeds, 2 loads, boundary elements)"
    )


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ([-0.18, -0.11, np.nan], "11 to 18 % too small"),
        ([0.02, 0.05], "2 to 5 % too large"),
        ([-0.03, 0.05], "from 3 % too small to 5 % too large"),
    ],
)
def test_ranges_have_one_sign_convention(values, words):
    assert _range(np.array(values)) == words
