"""The jump into contact of one paraboloid, and how far Wu's formula is from it."""

import re

import numpy as np
import pytest
from conftest import REPOSITORY
from scipy.special import hyp2f1

from icha.asperity.jkr import JKR, wu_gap
from icha.asperity.material import WU_HOLDS_FROM, Material
from validation.jump_in import displacement_matrix, jump_in_gap, nodes


def test_displacement_by_a_smooth_load_is_exact():
    # Hankel's transform of (1 + r^2)^-3 is k^2 K_2(k)/8; u is twice the integral of that times J_0(kr).
    squared = nodes() ** 2
    exact = 3 * np.pi / 8 * hyp2f1(0.5, 2.5, 1, -squared)
    np.testing.assert_allclose(displacement_matrix() @ (1 + squared) ** -3, exact, rtol=1e-9, atol=1e-9)


def test_wu_holds_from_where_the_models_say():
    for tabor_parameter in np.geomspace(WU_HOLDS_FROM, 1e6, 13):
        assert 0 < wu_gap(tabor_parameter) / jump_in_gap(tabor_parameter) - 1 < 0.005
    # Far from contact only the tail of the attraction counts, and the power is exact.
    far = [jump_in_gap(tabor_parameter) / tabor_parameter ** (3 / 7) for tabor_parameter in (1e5, 1e6)]
    assert far[0] == pytest.approx(2.6409, abs=5e-5) and far[1] == pytest.approx(far[0], rel=1e-8)


def test_the_gap_is_that_of_the_law():
    material = Material(1e6, 0.05, 1e-9)
    radius = 1e-6
    approach = 1e-9 * (1 - wu_gap(float(material.tabor_parameter(radius))))
    assert JKR(material).jump_in_approach(radius) == pytest.approx(approach, rel=1e-12)


@pytest.mark.parametrize("tabor_parameter", [0.69, 0.3, 0.01])
def test_stiff_paraboloids_do_not_jump(tabor_parameter):
    with pytest.raises(ValueError, match=f"tabor_parameter: {tabor_parameter}: contact forms without a jump"):
        jump_in_gap(tabor_parameter)


def test_the_docs_give_these_distances():
    text = (REPOSITORY / "docs/model.md").read_text()
    rows = re.findall(r"^\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) % \|$", text, flags=re.MULTILINE)
    assert len(rows) == 8
    for tabor_parameter, *written in rows:
        exact, wu = jump_in_gap(float(tabor_parameter)), wu_gap(float(tabor_parameter))
        numbers = (exact, wu, 100 * (wu / exact - 1))
        for number, digits in zip(numbers, written, strict=True):
            assert number == pytest.approx(float(digits), abs=0.51 * 10.0 ** -len(digits.partition(".")[2]))
