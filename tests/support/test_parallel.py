"""Results have the same bits on any number of cores."""

import numpy as np
import pytest

from icha import SelfAffineSpectrum
from icha.surfaces.summits import find_summits

PERIOD = 100e-6


@pytest.mark.filterwarnings("ignore:grid")
def test_surfaces_and_summits_have_the_same_bits_on_any_number_of_cores(monkeypatch):
    # Odd and even grids of several blocks, the last of them not full.
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        bits = b""
        for grid in (333, 600):
            surface = SelfAffineSpectrum(PERIOD, 20e-6, PERIOD / 100, 0.8).realise(grid, 1)
            summits = find_summits(surface)
            bits += surface.heights.tobytes() + np.array(surface.spectral_moments).tobytes()
            bits += summits.position.tobytes() + summits.height.tobytes() + summits.radius_of_curvature.tobytes()
        results.append(bits)
    assert results[0] == results[1] == results[2]
