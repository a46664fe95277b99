"""Gap and pressure: fields and distributions against brute force, closed forms and their identities."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.optimize
from fields import contact_cover, covered_nodes, displacement, displacement_field, gap
from half_space import periodic_displacement

from icha import Material, SelfAffineSpectrum, Surface
from icha.asperity.jkr import JKR
from icha.contact.model import PRESSURE_BINS, gap_bins
from icha.equilibrium.distributions import gap_distribution, pressure_distribution
from icha.equilibrium.interacting_asperities import contact_of
from icha.equilibrium.sites import Spots
from icha.half_space.grid_displacement import row_blocks

PERIOD, MODULUS = 100e-6, 25e6


def pressed(energy, levels=(2.5, 2.0, 1.5, 1.2), grid=64, seed=1):
    surface = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 16, 0.8).realise(grid, seed)
    contact = contact_of(surface, Material(MODULUS, energy, 2.071e-9))
    state = contact.untouched()
    for level in levels:
        state = contact.equilibrium(state, level * surface.rms_height)
    return surface, contact, state


@pytest.fixture(scope="module", params=[0.0, 0.05], ids=["bare", "adhesive"])
def case(request):
    return pressed(request.param)


def spots_of(position, a):
    a = np.asarray(a, float)
    return Spots(np.asarray(position, float), a * 0, a * 0 + 1, a, a * 0, np.ones(len(a), dtype=int), None)


@pytest.mark.parametrize("grid", [16, 17])
def test_cover_of_cells_against_counting(grid):
    surface = Surface(np.random.default_rng(0).normal(size=(grid, grid)), 1.0)
    # Large, smaller than a cell, on a node, across two borders, and of no radius.
    position, a = [[0.31, 0.42], [0.75, 0.125], [0.99, 0.985], [0.5, 0.9]], [0.2, 0.02, 0.11, 0.0]
    cover = contact_cover(surface, spots_of(position, a))
    fine = 60
    # Sub-cells of the cells around the nodes.
    x = (np.arange(grid * fine) + 0.5) / (grid * fine) - 0.5 / grid
    inside = np.zeros((grid * fine,) * 2)
    for (cx, cy), radius in zip(position, a, strict=True):
        dx, dy = x - cx, x - cy
        inside += np.hypot((dx - np.rint(dx))[None, :], (dy - np.rint(dy))[:, None]) < radius
    counted = inside.reshape(grid, fine, grid, fine).mean(axis=(1, 3))
    np.testing.assert_allclose(cover, counted, atol=3 / fine)
    assert cover.mean() == pytest.approx(np.sum(np.pi * np.square(a)), rel=1e-12)
    assert np.all((cover > -1e-12) & (cover < 1 + 1e-12))
    nodes = np.arange(grid)[:, None] * fine + fine // 2, np.arange(grid) * fine + fine // 2
    assert np.count_nonzero(covered_nodes(surface, spots_of(position, a)) != inside[nodes]) <= 2


def test_the_mean_of_the_gap_field_is_the_mean_separation(case):
    surface, contact, state = case
    w, u = displacement(contact.law, surface, state), gap(contact.law, surface, state)
    np.testing.assert_allclose(u, state.separation + w - surface.heights, atol=1e-12 * surface.rms_height)
    # The field's mean vanishes; that of its samples to the sampling of the spots' edges.
    assert abs(w.mean()) < 1e-4 * np.max(np.abs(w))
    assert u.mean() == pytest.approx(state.separation, rel=1e-4)


def test_at_every_single_summit_in_contact_the_gap_closes(case):
    surface, contact, state = case
    spots = state.spots
    single = np.flatnonzero(spots.members == 1)
    assert len(single) > 10
    # On a grid shifted so that its first node is the summit.
    w = [
        displacement_field(
            contact.law, PERIOD, 64, spots.position - spots.position[j], spots.contact_radius, spots.radius_of_curvature
        )[0, 0]
        for j in single
    ]
    # The solver and the field split the sum over images differently.
    np.testing.assert_allclose(w, spots.height[single] - state.separation, atol=1e-6 * surface.rms_height)


@pytest.fixture(scope="module")
def rough():
    """A surface of several blocks of rows with disjoint spots of all sizes on it, in no particular equilibrium."""
    grid = 800
    surface = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 100, 0.8).realise(grid, 2)
    assert len(row_blocks(grid)) > 1
    rng = np.random.default_rng(3)
    lattice = np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1).reshape(-1, 2)
    a = 10 ** rng.uniform(-4.5, -1.45, len(lattice)) * PERIOD
    spots = spots_of((lattice + 0.5 * rng.random(lattice.shape)) * (PERIOD / 12), a)
    spots = replace(spots, radius_of_curvature=a**2 / (0.3 * surface.rms_height))
    return surface, JKR(Material(MODULUS, 0.0, 1e-9)), SimpleNamespace(spots=spots, separation=2 * surface.rms_height)


def test_gap_distribution_of_many_spots_from_their_fields(rough):
    surface, law, state = rough
    gaps = gap_distribution(law, surface, state)
    u = np.where(covered_nodes(surface, state.spots), 0.0, gap(law, surface, state))
    outside = np.clip(1 - contact_cover(surface, state.spots), 0, 1) / surface.grid**2
    expected, _ = np.histogram(u, bins=gap_bins(surface), weights=outside)
    np.testing.assert_allclose(gaps["gap_density"] * np.diff(gap_bins(surface)), expected, rtol=1e-9, atol=1e-12)
    assert gaps["overlap_fraction"] == pytest.approx(np.sum(outside[u < 0]), rel=1e-9)
    area = np.sum(np.pi * state.spots.contact_radius**2) / PERIOD**2
    assert np.sum(expected) + gaps["overlap_fraction"] + area == pytest.approx(1, abs=1e-12)


def test_gap_distribution_around_one_hertz_spot():
    # One paraboloid on a fine grid: the area with gaps up to u is a ring whose radius follows from closed forms.
    n, R = 256, 100e-6
    x = np.arange(n) / n - 0.503
    r2 = ((x - np.rint(x)) ** 2)[None, :] + ((x - np.rint(x)) ** 2)[:, None]
    heights = -r2 * PERIOD**2 / (2 * R)
    surface = Surface(heights, PERIOD)
    contact = contact_of(surface, Material(MODULUS, 0.0, 1e-9))
    top = -heights.mean()
    state = contact.equilibrium(contact.untouched(), top - 4e-7)
    a = state.spots.contact_radius[0]
    gaps, edges = gap_distribution(contact.law, surface, state), gap_bins(surface)
    cumulative = np.concatenate([[0.0], np.cumsum(gaps["gap_density"] * np.diff(edges))]) + gaps["overlap_fraction"]

    def u(r):
        w = periodic_displacement(r, 0.0, a, R, MODULUS, 0.0, PERIOD)
        return state.separation + w - (top - r**2 / (2 * R))

    for factor in (1.5, 2.5, 4.0):
        level = u(factor * a)
        edge = int(np.argmin(np.abs(edges - level)))
        radius = scipy.optimize.brentq(lambda r, target=edges[edge]: u(r) - target, a, 6 * a)
        ring = np.pi * (radius**2 - a**2) / PERIOD**2
        assert cumulative[edge] == pytest.approx(ring, rel=0.01)


def test_identities_of_the_pressure_distribution(case):
    surface, contact, state = case
    pressures = pressure_distribution(contact.law, surface, state.spots)
    width = np.diff(PRESSURE_BINS * MODULUS * surface.rms_slope)
    assert np.sum(pressures["pressure_density"] * width) == pytest.approx(contact.area_fraction(state), rel=1e-12)
    assert np.sum(pressures["pressure_density"] * width * pressures["pressure_bin_mean"]) == pytest.approx(
        contact.pressure(state), rel=1e-12
    )
    tension = pressures["pressure_density"][(PRESSURE_BINS * MODULUS * surface.rms_slope)[1:] <= 0].sum()
    assert (tension > 0) == (contact.law.material.surface_energy > 0)
    # The pressures at the edges of spots are below the first bin, which ends where figures do.
    assert np.abs(PRESSURE_BINS).max() < 502
    filled = np.flatnonzero(pressures["pressure_density"] > 0)
    # A bin's mean lies in it; the first also holds the tail to minus infinity.
    inner = filled[filled > 0]
    slack = 1e-6 * width[inner]
    assert np.all(pressures["pressure_bin_mean"][inner] >= (PRESSURE_BINS * MODULUS * surface.rms_slope)[inner] - slack)
    assert np.all(
        pressures["pressure_bin_mean"][inner] <= (PRESSURE_BINS * MODULUS * surface.rms_slope)[inner + 1] + slack
    )
    assert np.all(pressures["pressure_bin_mean"][np.setdiff1d(np.arange(len(width)), filled)] == 0)


def test_pressure_distribution_by_sampling_the_spots(case):
    surface, contact, state = case
    spots = state.spots
    pressures = pressure_distribution(contact.law, surface, spots)
    t = (np.arange(20_000) + 0.5) / 20_000
    counted = np.zeros(len(pressures["pressure_density"]))
    for a, R in zip(spots.contact_radius, spots.radius_of_curvature, strict=True):
        p = contact.law.pressure(a * np.sqrt(t), a, R)
        counted += (
            np.histogram(p, bins=(PRESSURE_BINS * MODULUS * surface.rms_slope))[0] * np.pi * a**2 / (len(t) * PERIOD**2)
        )
    np.testing.assert_allclose(
        pressures["pressure_density"] * np.diff(PRESSURE_BINS * MODULUS * surface.rms_slope),
        counted,
        atol=2e-4 * counted.sum(),
    )


def test_pressures_and_gaps_beyond_the_bins_are_counted_in_the_last_one():
    surface, contact, state = pressed(0.0)
    sharp = replace(state.spots, radius_of_curvature=1e-6 * state.spots.radius_of_curvature)
    pressures = pressure_distribution(contact.law, surface, sharp)
    content = pressures["pressure_density"] * np.diff(PRESSURE_BINS * MODULUS * surface.rms_slope)
    assert content[-1] > 0
    assert pressures["pressure_bin_mean"][-1] > (PRESSURE_BINS * MODULUS * surface.rms_slope)[-1]
    assert np.sum(content) == pytest.approx(np.sum(np.pi * sharp.contact_radius**2) / surface.period**2, rel=1e-9)
    force = np.sum(contact.law.force(sharp.contact_radius, sharp.radius_of_curvature)) / surface.period**2
    assert np.sum(content * pressures["pressure_bin_mean"]) == pytest.approx(force, rel=1e-9)

    gaps = gap_distribution(contact.law, surface, replace(state, separation=40 * surface.rms_height))
    content = gaps["gap_density"] * np.diff(gap_bins(surface))
    assert content[-1] > 0.9
    assert np.sum(content) + contact.area_fraction(state) == pytest.approx(1, abs=1e-12)
