"""Summits against the exact maxima of band-limited surfaces, evaluated as Fourier sums."""

import numpy as np
import pytest
import scipy.optimize
from scipy.spatial import cKDTree

from icha import Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.surfaces.summits import find_summits, locate_summits, paraboloid_departure

PERIOD = 100e-6
SPECTRUM = SelfAffineSpectrum(PERIOD, 20e-6, PERIOD / 16, 0.8)


class FourierSum:
    """Heights, gradients and Hessians of a band-limited periodic surface at any point, in units of the cell."""

    def __init__(self, surface, highest):
        n = surface.grid
        spectrum = np.fft.fft2(surface.heights) / n**2
        self.k = np.arange(-highest, highest + 1)
        self.c = spectrum[np.ix_(self.k % n, self.k % n)]

    def __call__(self, x, y, dy=0, dx=0):
        ey = (2j * np.pi * self.k) ** dy * np.exp(2j * np.pi * self.k * y)
        ex = (2j * np.pi * self.k) ** dx * np.exp(2j * np.pi * self.k * x)
        return (ey @ self.c @ ex).real

    def gradient(self, at):
        return np.array([self(*at, 0, 1), self(*at, 1, 0)])

    def hessian(self, at):
        mixed = self(*at, 1, 1)
        return np.array([[self(*at, 0, 2), mixed], [mixed, self(*at, 2, 0)]])


def exact_maxima(surface, highest=16, fine=512):
    """All maxima: from the nodes of a far finer grid (Fourier interpolation) near a critical point."""
    exact = FourierSum(surface, highest)
    n = fine
    spectrum = np.zeros((n, n), dtype=complex)
    spectrum[np.ix_(exact.k % n, exact.k % n)] = exact.c
    q = 2j * np.pi * np.fft.fftfreq(n, 1 / n)
    qy, qx = q[:, None], q[None, :]
    gy, gx, hyy, hxx, hxy = (np.fft.ifft2(spectrum * factor).real * n**2 for factor in (qy, qx, qy**2, qx**2, qx * qy))
    determinant = hyy * hxx - hxy**2
    with np.errstate(divide="ignore"):
        step = np.hypot(hxx * gy - hxy * gx, hyy * gx - hxy * gy) / np.abs(determinant)
    start = np.argwhere((determinant > 0) & (hxx < 0) & (step < 1.5 / n))[:, ::-1] / n
    found = []
    for guess in start:
        solution = scipy.optimize.root(exact.gradient, guess, jac=exact.hessian, tol=1e-13)
        at = solution.x
        if np.max(np.abs(exact.gradient(at))) < 1e-9 * surface.rms_height * 1e3 and np.all(
            np.linalg.eigvalsh(exact.hessian(at)) < 0
        ):
            at = np.mod(at, 1)
            if not any(np.max(np.abs((at - other + 0.5) % 1 - 0.5)) < 1e-6 for other in found):
                found.append(at)
    at = np.array(found)
    height = np.array([exact(*p) for p in at])
    radius = np.array([1 / np.sqrt(np.linalg.det(exact.hessian(p))) for p in at])
    return at * surface.period, height, radius * surface.period**2


@pytest.mark.parametrize(("grid", "height_error", "radius_error"), [(128, 2e-4, 1e-2), (256, 3e-6, 3e-4)])
def test_all_maxima_of_a_rough_surface_are_found(grid, height_error, radius_error):
    surface = SPECTRUM.realise(grid, 1)
    position, height, radius = exact_maxima(surface)
    summits = find_summits(surface)
    assert len(summits) == len(height)
    distance, index = cKDTree(np.mod(position, PERIOD), boxsize=PERIOD).query(summits.position)
    assert len(set(index)) == len(index)
    np.testing.assert_allclose(summits.height, height[index], atol=height_error * surface.rms_height)
    # Where one of the curvatures nearly vanishes, its relative error is amplified: the others must be as good as
    # the spline, the worst may be ten times worse.
    error = np.abs(summits.radius_of_curvature / radius[index] - 1)
    assert np.quantile(error, 0.9) < radius_error
    assert error.max() < 10 * radius_error
    assert np.quantile(distance, 0.9) < 0.05 * surface.spacing


@pytest.mark.parametrize("centre", [(0.5, 0.5), (0.503, 0.4963), (0.0, 0.9999)])
def test_one_paraboloid_is_found_below_the_grid(centre):
    n, curvature_radius = 64, 7e-3
    x = np.arange(n) / n
    dx, dy = x - centre[0], x - centre[1]
    r2 = ((dx - np.rint(dx)) ** 2)[None, :] + ((dy - np.rint(dy)) ** 2)[:, None]
    heights = -r2 * PERIOD**2 / (2 * curvature_radius)
    summits = find_summits(Surface(heights, PERIOD))
    assert len(summits) == 1
    offset = summits.position[0] / PERIOD - centre
    np.testing.assert_allclose(offset - np.rint(offset), 0, atol=1e-9)
    assert summits.height[0] == pytest.approx(-heights.mean(), rel=1e-9)
    assert summits.radius_of_curvature[0] == pytest.approx(curvature_radius, rel=1e-8)


def test_the_radius_is_the_geometric_mean_of_an_ellipsoidal_summit():
    n = 64
    x = 2 * np.pi * np.arange(n) / n
    heights = 3e-7 * np.cos(x)[None, :] + 2e-7 * np.cos(x)[:, None]
    summits = find_summits(Surface(heights, PERIOD))
    q2 = (2 * np.pi / PERIOD) ** 2
    assert len(summits) == 1
    # The quintic spline has the curvature of a wave to (q dx)^4/720.
    error = (2 * np.pi / n) ** 4 / 720
    assert summits.radius_of_curvature[0] == pytest.approx(1 / np.sqrt(3e-7 * q2 * 2e-7 * q2), rel=1.1 * error)


def test_a_summit_between_equal_nodes_is_found_once():
    n = 32
    x = 2 * np.pi * (np.arange(n) - 0.5) / n
    surface = Surface(1e-6 * (np.cos(4 * x)[None, :] + np.cos(4 * x)[:, None]), PERIOD)
    summits = find_summits(surface)
    assert len(summits) == 16
    offset = (summits.position / surface.spacing - 0.5) / 8
    np.testing.assert_allclose(offset, np.rint(offset), atol=1e-6)


@pytest.mark.parametrize("grid", [32, 64, 128])
def test_oblique_elongated_summits_do_not_depend_on_the_grid(grid):
    # Ridges with 125 times the curvature across as along, at an angle to the grid: the highest nodes of a coarse
    # grid lie somewhere along the crest.
    x = 2 * np.pi * np.arange(grid) / grid
    across = np.cos(4 * x[None, :] + 3 * x[:, None])
    along = np.cos(-1 * x[None, :] + 1 * x[:, None])
    summits = find_summits(Surface(1e-6 * (across + 0.1 * along), PERIOD))
    # Both cosines are one at 7 points of the cell, the determinant of ((4, 3), (-1, 1)); there det H = A B 7^2 q^4.
    assert len(summits) == 7
    exact = 1 / (1e-6 * np.sqrt(0.1) * 7 * (2 * np.pi / PERIOD) ** 2)
    # The spline's error of the large curvature, (q dx)^4/720, is that much larger beside the small one.
    error = 0.5 * 125 * (5 * 2 * np.pi / grid) ** 4 / 720
    np.testing.assert_allclose(summits.radius_of_curvature, exact, rtol=error)
    np.testing.assert_allclose(summits.height, 1.1e-6, rtol=error / 125)


def test_every_summit_of_a_resolved_surface_is_supported():
    """Of smooth surfaces with eight and more nodes per shortest wave nothing is left out but a summit in a thousand."""
    for cells, most in ((12, 0.0), (8, 2e-3), (5, 0.02)):
        spectrum = SelfAffineSpectrum(1.0, 0.25, cells / 256, hurst=0.8, rms_slope=0.3)
        found = [find_summits(spectrum.realise(256, seed)) for seed in (1, 2, 3)]
        left_out = sum(len(each.unsupported_height) for each in found)
        assert left_out <= most * sum(map(len, found))


@pytest.mark.filterwarnings("ignore:grid")
def test_surfaces_and_summits_have_the_same_bits_on_any_number_of_cores(monkeypatch):
    """Odd and even grids of several blocks, the last of them not full."""
    results = set()
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        bits = b""
        for grid in (333, 600):
            surface = SelfAffineSpectrum(PERIOD, 20e-6, PERIOD / 100, 0.8).realise(grid, 1)
            found = find_summits(surface)
            arrays = (
                surface.heights,
                surface.spectral_moments,
                found.position,
                found.height,
                found.radius_of_curvature,
            )
            bits += b"".join(np.array(each).tobytes() for each in arrays)
        results.add(bits)
    assert len(results) == 1


@pytest.mark.parametrize(("place", "rise"), [(np.s_[:, :32], 40), (np.s_[20], -40)], ids=["plateau", "lost line"])
def test_no_summit_lies_above_what_its_nodes_support(place, rise):
    """Beside a step or a lost line the spline rises by rms heights above all nodes; such maxima are left out."""
    surface = SelfAffineSpectrum(1.0, 0.25, 10 / 64, hurst=0.8, rms_slope=0.3).realise(64, 4)
    heights = np.array(surface.heights)
    heights[place] += rise * surface.rms_height
    damaged = Surface(heights, surface.period)
    heights = damaged.heights
    smooth, found = locate_summits(surface), locate_summits(damaged)
    assert found.unsupported_height.max() > heights.max() + surface.rms_height
    assert found.height.max() < heights.max() + 0.1 * surface.rms_height
    # What lies away from the damage is found as before.
    assert len(found) > 0.5 * len(smooth)


def test_summits_that_all_lack_support_are_refused_with_what_to_do():
    heights = np.where(np.add.outer(np.arange(32) // 8, np.arange(32) // 8) % 2, 1.0, 0.0)
    surface = Surface(heights, 1.0)
    assert len(locate_summits(surface)) == 0 and len(locate_summits(surface).unsupported_height)
    with pytest.raises(ValueError, match=r"support none of the \d+ summits.* boundary_elements"):
        find_summits(surface)


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_tops_depart_from_paraboloids_as_their_shapes_do(boundary):
    grid, at, radius = 64, np.array([[0.5, 0.5]]) * PERIOD, 8e-6
    y, x = (np.mgrid[:grid, :grid] / grid - 0.5) * PERIOD
    distance = np.hypot(x, y)

    def departure(heights, contact_radius, radius_of_curvature):
        surface = Surface(heights - heights.mean(), PERIOD, boundary=boundary)
        return paraboloid_departure(surface, at, np.array([contact_radius]), np.array([radius_of_curvature]))

    assert departure(-(distance**2) / 2e-5, radius, 1e-5) < 1e-3
    # A cone falls by a times its slope: here half of what the paraboloid does.
    assert departure(-0.2 * distance, radius, 1e-5) == pytest.approx(np.log(2), abs=0.02)
    assert departure(-(distance**2) / 2e-5, 0.1 * PERIOD / grid, 1e-5) == 0


def _smooth(seed):
    return SelfAffineSpectrum(PERIOD, 25e-6, 12.5e-6, 0.8, 0.3).realise(64, seed).heights


def _worn(seed):
    heights = _smooth(seed)
    top = 0.8 * heights.std()
    return np.where(heights > top, top + 0.2 * (heights - top), heights)


def _conical(seed):
    y, x = np.mgrid[:64, :64] / 64
    return _smooth(seed) / 30 - 1e-5 * np.hypot((4 * x) % 1 - 0.5, (4 * y) % 1 - 0.5)


def _white(seed):
    return np.random.default_rng(seed).standard_normal((32, 32)) * 1e-7


@pytest.mark.parametrize(
    ("make", "energy", "model", "marked"),
    [
        (_worn, 5e-3, "asperities", "not parabolic"),
        (_conical, 0.0, "asperities", "not parabolic"),
        (_smooth, 5e-3, "asperities", ""),
        (_white, 0.0, "boundary_elements", "cells per shortest wave"),
        (_smooth, 0.0, "boundary_elements", ""),
    ],
)
def test_runs_on_tops_that_are_not_parabolic_and_on_too_few_cells_are_marked(make, energy, model, marked):
    material, path = Material(2e6, energy, 2e-9), Path(reduced_pressures=[1e-3, 1e-2], snapshots=[])
    for seed in (1, 2, 3) if model == "asperities" else (1,):
        run = simulate(Surface(make(seed), PERIOD).scaled_to_rms_slope(0.3), material, path, model=model)
        found = [each for each in ("not parabolic", "cells per shortest wave") if each in run.attrs["applicability"]]
        assert found == [marked] * (marked != "")
