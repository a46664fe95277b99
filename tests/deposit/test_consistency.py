"""A deposit is never made of results that do not belong together."""

import pytest
import small_campaign as small
from bare_campaign import CAMPAIGN
from icha.deposit.consistency import refuse_mixed

from icha.configuration.cases import run_cases
from icha.configuration.load import load_configuration
from icha.configuration.settings import campaign_sha256, run_sha256
from icha.datasets.files import write_dataset
from icha.planning.results import campaign_files
from icha.support.checksums import asked_of, sha256_as_written, write_checksum

ASKED = asked_of(["0"])


@pytest.fixture
def campaign(tmp_path):
    """The campaign, what is asked of it, and two runs and a dataset that belong together."""
    (tmp_path / "small.yaml").write_text(CAMPAIGN)
    campaign = load_configuration(tmp_path / "small.yaml").campaign
    files = campaign_files(campaign)
    for path, case in files.runs.items():
        write(tmp_path, path, run_sha256(campaign, case))
    inputs = {path: sha256_as_written(tmp_path, path) for path in files.runs}
    write(tmp_path, files.dataset, campaign_sha256(campaign), inputs)
    return campaign, dict.fromkeys([*files.runs, files.dataset], ASKED)


def write(results, path, sha256, inputs=(), summary="One"):
    write_dataset(small.run().assign_attrs(config_sha256=sha256, summary=summary), results / path)
    write_checksum(results, path, asked=ASKED, inputs=dict(inputs))


def test_results_that_belong_together_are_published(campaign, tmp_path):
    refuse_mixed(tmp_path, *campaign)


def test_a_run_of_other_settings_is_named(campaign, tmp_path):
    path = f"runs/{run_cases(campaign[0])[1].path}.nc"
    write(tmp_path, path, "a" * 64)
    with pytest.raises(ValueError, match="do not belong together") as raised:
        refuse_mixed(tmp_path, *campaign)
    said = str(raised.value)
    assert f"{tmp_path}/{path}: it was not computed with the settings of this campaign" in said
    assert f"{tmp_path}/dataset/small.nc: it was made from another {path} than is there" in said
    assert len(said.splitlines()) == 3


def test_a_run_that_the_dataset_was_not_made_from_is_found_though_its_settings_are_right(campaign, tmp_path):
    case = run_cases(campaign[0])[0]
    write(tmp_path, f"runs/{case.path}.nc", run_sha256(campaign[0], case), summary="Of an older program")
    with pytest.raises(ValueError, match=f"dataset/small.nc: it was made from another runs/{case.path}.nc"):
        refuse_mixed(tmp_path, *campaign)


def test_a_dataset_of_another_campaign_and_a_record_of_another_job_are_named(campaign, tmp_path):
    (campaign, asked), other = campaign, asked_of(["1"])
    write(tmp_path, "dataset/small.nc", "b" * 64)
    with pytest.raises(ValueError, match=r"dataset/small.nc: it was not computed with the settings"):
        refuse_mixed(tmp_path, campaign, asked)
    write(tmp_path, "dataset/small.nc", campaign_sha256(campaign))
    with pytest.raises(ValueError, match=r"dataset/small.nc: the workflow has recorded another job for it"):
        refuse_mixed(tmp_path, campaign, asked | {"dataset/small.nc": other})
