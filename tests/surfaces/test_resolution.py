"""Resolution of a scan: summits, the noise of the instrument, and advice."""

import numpy as np
import pytest
from scans import preparation

from icha import SelfAffineSpectrum, Surface
from icha.surfaces.measured.resolution import examine_scan, filtered_slope_share, noise_floor

SIDE, GRID = 100e-6, 200
SPECTRUM = SelfAffineSpectrum(SIDE, 50e-6, 4e-6, 0.8, rms_slope=0.1)


def noisy(noise, boundary="free", grid=GRID):
    heights = SPECTRUM.realise(grid, 1).heights
    return Surface(heights + noise * np.random.default_rng(1).normal(size=heights.shape), SIDE, boundary)


@pytest.mark.parametrize("boundary", ["free", "periodic"])
@pytest.mark.parametrize("noise", [1e-9, 10e-9, 50e-9])
def test_noise_of_each_pixel_is_found_with_its_height(boundary, noise):
    floor = noise_floor(noisy(noise, boundary))
    assert floor.rms == pytest.approx(noise, rel=0.1)
    # The surface ends at 4 um; what is shorter is noise, and so is longer what is lower than the noise.
    assert 3e-6 < floor.wavelength < 4.5e-6


def test_the_slope_that_a_cut_off_leaves(examined):
    rough = SPECTRUM.realise(GRID, 1)
    for cutoff in (4e-6, 8e-6):
        filtered = examined(rough, cutoff=cutoff).surface
        assert filtered_slope_share(rough, cutoff) == pytest.approx(filtered.rms_slope / rough.rms_slope, rel=0.05)


@pytest.mark.filterwarnings("ignore:grid")
@pytest.mark.parametrize("hurst", [0.1, 0.5, 1.0])
def test_a_spectrum_that_falls_to_its_end_has_no_floor(hurst):
    for short in (SIDE / GRID * 2.001, SIDE / GRID * 8):
        surface = SelfAffineSpectrum(SIDE, 50e-6, short, hurst, rms_slope=0.1).realise(GRID, 1)
        assert noise_floor(surface) is None
        assert noise_floor(Surface(surface.heights, SIDE, "free")) is None


@pytest.fixture
def examined(tmp_path):
    def look(surface, **keys):
        np.save(tmp_path / "scan.npy", surface.heights)
        keys = {"height_unit": 1.0, "size": (surface.period, surface.period), "boundary": "free"} | keys
        return examine_scan(tmp_path / "scan.npy", preparation(**keys))

    return look


def test_above_the_noise_a_cutoff_is_advised_that_removes_it(examined):
    scan = examined(noisy(50e-9))
    assert scan.noise.wavelength <= scan.advice["cutoff"] <= 1.1 * scan.noise.wavelength
    # Eight cells for every wave of the cut-off are enough.
    again = examined(noisy(50e-9), cutoff=scan.advice["cutoff"])
    assert again.advice == {} and again.noise == scan.noise
    assert len(again.asperities) < 0.5 * len(scan.asperities)
    clean = examined(noisy(0.0), cutoff=scan.advice["cutoff"])
    assert abs(again.surface.rms_slope / clean.surface.rms_slope - 1) < 0.05
    # Against noise alone, no cut-off helps.
    for seed in (1, 2, 3):
        scan = examined(Surface(np.random.default_rng(seed).normal(size=(96, 96)), SIDE, "free"))
        assert scan.noise.rms == pytest.approx(1, rel=0.1) and scan.noise.slope_share > 0.99 and scan.advice == {}


@pytest.mark.filterwarnings("ignore:grid")
def test_summits_as_small_as_pixels_are_to_be_filtered_until_they_are_resolved(examined):
    fine = SelfAffineSpectrum(SIDE, 50e-6, 2.001 * SIDE / GRID, 0.8, rms_slope=0.1).realise(GRID, 1)
    scan = examined(fine)
    assert scan.noise is None and not scan.resolution.reaches(4)
    assert scan.advice == {"cutoff": pytest.approx(8 * SIDE / GRID)}
    again = examined(fine, **scan.advice)
    assert again.resolution.reaches(4) and again.advice == {}


def test_a_resolved_surface_needs_nothing_and_a_needlessly_fine_grid_is_reported(examined):
    resolved = SelfAffineSpectrum(SIDE, 50e-6, 10e-6, 0.8, rms_slope=0.1).realise(GRID, 1)
    scan = examined(resolved, boundary="periodic")
    assert scan.noise is None and scan.advice == {} and scan.resolution.reaches(8)
    assert examined(resolved, boundary="periodic", cutoff=10e-6).advice == {"grid": 80}
