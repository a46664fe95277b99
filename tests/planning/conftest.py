"""Campaigns with a scan and a map of heights."""

import numpy as np
import pytest


@pytest.fixture
def read(load, tmp_path):
    """Return a function that loads a changed campaign, in a folder with a scan and a part of it."""
    heights = np.random.default_rng(1).normal(size=(40, 40))
    np.save(tmp_path / "scan.npy", heights)
    np.save(tmp_path / "map.npy", heights[:30, :30])
    return lambda changes: load(changes).campaign


@pytest.fixture
def campaign(read, request):
    """Return the campaign of the module."""
    return read(request.module.CHANGES)
