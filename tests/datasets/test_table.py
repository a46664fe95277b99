"""The tidy table of a campaign, and varied parameters as coordinates."""

import io

import numpy as np
import pandas as pd
import pytest
import small_campaign as small

from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.table import as_csv, tidy_table

NAMES = {"rough-hurst0.6": 0.6, "rough-hurst0.8": 0.8}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "campaign.nc"
    runs = [
        (RunLabels("one", "asperities", name, seed, 1.0, "soft"), small.run(seed)) for name in NAMES for seed in (1, 2)
    ]
    varied = {"one": {"hurst": ("surface", "1", NAMES), "surface_energy": ("material", "J m^-2", {"soft": 9.0})}}
    write_dataset(campaign_tree(runs, varied=varied), path)
    return read_campaign(path)


def test_varied_parameters_are_coordinates_unless_the_runs_have_them(campaign):
    study = campaign["one"].to_dataset()
    assert study.hurst.dims == ("surface",) and study.hurst.values.tolist() == [0.6, 0.8]
    assert "hurst" in study.coords and "hurst" in study.nominal_pressure.coords
    assert study.surface_energy.values.tolist() == [float(small.run(1).surface_energy)]


def test_each_target_of_each_run_is_a_row_with_the_values_of_the_run(campaign):
    table = pd.read_csv(io.StringIO(as_csv(tidy_table(campaign))))
    run = small.run(2)
    rows = table[(table.surface == "rough-hurst0.8") & (table.seed == 2)]
    assert len(table) == 4 * run.sizes["step"] and (table.status == "complete").all()
    assert set(rows.hurst) == {0.8} and rows.step_kind.tolist() == run.step_kind.values.tolist()
    for column, name in (
        ("nominal_pressure_Pa", "nominal_pressure"),
        ("contact_stiffness_Pa_per_m", "contact_stiffness"),
        ("contact_area_fraction", "contact_area_fraction"),
        ("step_target", "step_target"),
    ):
        np.testing.assert_allclose(rows[column], run[name], rtol=1e-9)
    assert set(rows.contact_modulus_Pa) == {float(run.contact_modulus)}
