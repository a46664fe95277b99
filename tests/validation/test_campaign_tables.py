"""Tables of the pages on the model's error and on hysteresis, from datasets with known numbers."""

import compared_campaign as compared
import numpy as np
import pytest
import separate_asperities as separate
import xarray as xr

from icha.analysis.model_error import model_error
from validation import hysteresis
from validation.model_error import errors_by_load, tables


@pytest.fixture(scope="module")
def entries():
    short = model_error(compared.tree_of_both(), compared.patches())["one"].to_dataset()
    finite = compared.errors()["one"].to_dataset()
    return {"short_range": short, "finite_range": finite.sel(material=["soft"]), "ranges": finite}


def test_every_table_of_the_models_error_can_be_written(entries):
    found = tables(entries, xr.DataTree())
    assert len(found) == 7
    for name, table in found.items():
        assert "nan" not in str(table) and all(len(row) == len(table.head) for row in table.rows), name


def test_errors_are_in_per_cent_with_their_scatter():
    _, (row,), _ = errors_by_load(compared.errors()["one"].to_dataset().sel(material=["soft"]), "area_error")
    each = [100 * (1 / factor - 1) for factor in compared.AREA_FACTORS.values()]
    assert row == ["`rough`", *[f"{np.mean(each):+.1f} ± {np.std(each, ddof=1):.1f}"] * 2]


def test_pull_off_and_loss_are_means_over_the_seeds():
    attrs = {"units": "1", "long_name": "test"}
    study = [
        (labels, run.assign(stickiness=((), 0.5, attrs)))
        for labels, run in separate.study("slopes", depth=0.0, slopes=(1.0,))
    ]
    head, (row,), _ = hysteresis.summary(separate.tree(study)["slopes"].to_dataset())
    pull_off = [float(separate.run("sticky", 1.0, seed, 0.0).pull_off_pressure) for seed in (1, 2)]
    assert row[head.index("pull-off, Pa")] == f"{np.mean(pull_off):.3g} ± {np.std(pull_off, ddof=1):.3g}"
