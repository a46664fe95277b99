"""Section `defaults`."""

import numpy as np
import pytest

from icha.configuration.cases import run_cases
from icha.configuration.errors import ConfigurationError


def test_defaults_serve_entries_that_do_not_give_their_own(load, tmp_path):
    np.save(tmp_path / "own.npy", np.random.default_rng(1).random((16, 16)))
    changes = {
        "defaults": {
            "surfaces": {"period": "100 um", "hurst": 0.3, "grid": 80},
            "materials": {"surface_energy": "1 mJ/m^2", "interaction_range": "2 nm"},
            "studies": {"seeds": "1..3", "materials": ["soft", "hard"]},
        },
        "surfaces.rough.period": None,
        "surfaces.rough.grid": None,
        # Of another kind, which has no Hurst exponent.
        "surfaces.own": {"kind": "file", "path": "own.npy", "height_unit": "um"},
        "materials.hard": {"contact_modulus": "1 GPa"},
        "studies.one.seeds": None,
        "studies.one.materials": None,
    }
    campaign = load(changes).campaign
    assert campaign.surfaces["rough"].hurst == 0.8 and campaign.surfaces["rough"].grid == 80
    assert campaign.surfaces["own"].period == 1e-4
    assert campaign.materials["hard"].surface_energy == 1e-3
    assert campaign.materials["soft"].surface_energy == 0.05
    assert len(run_cases(campaign)) == 3 * 2 * 2
    with pytest.raises(ConfigurationError, match=r"defaults\.materials\.interaction_range: '2 m\^2'"):
        load({**changes, "defaults": {"materials": {"interaction_range": "2 m^2", "surface_energy": "1 mJ/m^2"}}})
