"""The fast reader of runs returns the content of the file."""

import numpy as np
import pytest
import small_campaign as small

from icha.datasets.campaign_runs import read_run_values
from icha.datasets.files import characters, is_text, write_dataset


def written(run, path):
    write_dataset(run, path)
    return path


@pytest.mark.parametrize("spots", [None, 0])
def test_all_values_come_back_with_their_dimensions(tmp_path, spots):
    run = small.run().isel(spot=slice(spots))
    values, attrs = read_run_values(written(run, tmp_path / "run.nc"))
    assert values.keys() == set(run.variables)
    for name, (dims, own) in values.items():
        given = run[name].values
        assert dims == run[name].dims
        np.testing.assert_array_equal(own, characters(given) if is_text(given.dtype) else given, strict=True)
    assert attrs == {name: run.attrs[name] for name in ("contact_model", "config_sha256", "applicability")}


def test_why_a_run_is_incomplete_is_read(tmp_path):
    path = written(small.run().assign_attrs(incomplete="lost at 3 µm"), tmp_path / "run.nc")
    values, attrs = read_run_values(path)
    assert attrs["incomplete"] == "lost at 3 µm"
    assert "mean_separation" in values
