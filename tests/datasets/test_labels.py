"""Names of runs."""

import pytest

from icha.datasets.labels import number_label


@pytest.mark.parametrize("value", [0.1, 0.1 + 0.2, 1.0, 1e-5, 12.5, 100.0])
def test_slopes_in_paths_read_back(value):
    assert float(number_label(value)) == value
    assert "/" not in number_label(value) and " " not in number_label(value)
