"""What runs are told, and checksums of it."""

import numpy as np
from demo_configuration import file_surface

from icha.configuration.cases import campaign_sha256, run_cases, run_sha256


def test_settings_depend_on_values_not_on_how_they_are_written(load):
    def checksum(campaign):
        return run_sha256(campaign, run_cases(campaign)[0]), campaign_sha256(campaign)

    first = checksum(load().campaign)
    assert checksum(load({"materials.soft.contact_modulus": "25000 kPa", "title": "Other"}).campaign) == first
    assert checksum(load({"materials.soft.contact_modulus": "26 MPa"}).campaign) != first
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[0] == first[0]
    assert checksum(load({"studies.one.seeds": [1, 3]}).campaign)[1] != first[1]


def test_another_file_of_the_same_name_is_another_run(load, tmp_path):
    def checksum():
        campaign = load({"surfaces.rough": file_surface("own.npy")}).campaign
        return run_sha256(campaign, run_cases(campaign)[0])

    heights = np.random.default_rng(1).random((16, 16))
    np.save(tmp_path / "own.npy", heights)
    first = checksum()
    np.save(tmp_path / "own.npy", heights)
    assert checksum() == first
    np.save(tmp_path / "own.npy", heights + 1)
    assert checksum() != first
