"""Variants between the model and boundary elements, against Hertz, closed sums and each other."""

import numpy as np
import pytest
import xarray as xr

import icha
from icha.asperity.jkr import JKR
from icha.boundary_elements.contact import contact_of
from icha.boundary_elements.patches import CellState
from icha.contact.model import PRESSURE, Control
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.surfaces.summits import Asperities, find_summits
from validation.error_source_tables import figure
from validation.error_sources import chain, effects, error_sources, shape_ratio, shape_ratio_of_fourth_order
from validation.paraboloids import fourth_order_terms, summit_curvatures
from validation.spot_by_spot import contact_patches, match
from validation.without_unions import discs_apart

HARD = icha.Material(contact_modulus=2.0, surface_energy=0.0, interaction_range=1e-3)
LAW = JKR(HARD)
PRESSURES = [2e-3, 1e-2, 3e-2]


def summits_at(position, height, radius, period):
    return Asperities(np.array(position, float), np.array(height, float), np.array(radius, float), period)


@pytest.fixture(scope="module")
def surface():
    spectrum = icha.SelfAffineSpectrum(
        period=1.0, rolloff_wavelength=0.4, short_wavelength=0.12, hurst=0.8, rms_slope=0.5
    )
    return spectrum.realise(grid=64, seed=3)


@pytest.fixture(scope="module")
def sources(surface):
    return error_sources(surface, HARD, PRESSURES)


# --- surfaces ---------------------------------------------------------------------------------------------------


def test_curvatures_and_fourth_order_of_crossed_waves():
    x = np.arange(48) * (2.0 / 48)
    q, along_x, along_y = np.pi, 0.3, 0.1
    surface = icha.Surface(along_x * np.cos(q * x) + along_y * np.cos(q * x)[:, None], 2.0)
    summits = find_summits(surface)
    assert summit_curvatures(surface, summits) == pytest.approx(
        np.array([[-along_x * q**2, 0.0, -along_y * q**2]]), abs=1e-9
    )
    assert fourth_order_terms(surface, summits.position) == pytest.approx([(along_x + along_y) * q**4 / 64], rel=1e-9)


# --- contact without unions -------------------------------------------------------------------------------------


@pytest.mark.parametrize("field_shape", [False, True])
def test_a_single_summit_is_hertz_with_its_images(field_shape):
    radius, period, pressure = 1.0, 40.0, 1e-6
    summits = summits_at([[3.0, 4.0]], [0.5], [radius], period)
    discs = discs_apart(summits, LAW, pressure, 0.1, field_shape=field_shape)
    force = pressure * period**2
    a = np.cbrt(0.75 * force * radius / 2.0)
    assert discs.contact_radius == pytest.approx([a], rel=1e-5)
    # Images and counter-pressure of a point load on a square cell.
    images = -3.900265 * force / (np.pi * 2.0 * period)
    assert discs.separation == pytest.approx(0.5 - a**2 / radius - images, abs=1e-4 * a**2)


def test_without_overlaps_it_is_the_model(surface):
    contact = InteractingAsperities(LAW, find_summits(surface), surface.rms_height, surface.rms_slope)
    unit = 2.0 * surface.rms_slope
    (waypoint,) = follow(contact, icha.Path(reduced_pressures=[5e-4]))
    state = waypoint.state
    assert np.all(state.spots.members == 1)
    discs = discs_apart(contact.asperities, LAW, 5e-4 * unit, surface.rms_height, field_shape=False)
    assert discs.separation == pytest.approx(state.separation, rel=1e-7)
    assert np.sort(discs.contact_radius) == pytest.approx(np.sort(state.spots.contact_radius), rel=1e-6)
    area = np.pi * np.sum(discs.contact_radius**2) / surface.period**2
    assert area == pytest.approx(contact.area_fraction(state), rel=1e-6)


# --- patches ----------------------------------------------------------------------------------------------------


def patches_of(traction, period=1.0):
    """The area fraction and the patches of a contact without adhesion with the given tractions."""
    some_surface = icha.Surface(np.random.default_rng(0).random(traction.shape), period)
    contact, cells = contact_of(some_surface, HARD), np.flatnonzero(traction)
    state = CellState(0.0, cells, np.ones(len(cells)), traction.ravel()[cells], np.ones(len(cells)))
    return contact.area_fraction(state), contact_patches(contact, state)


def test_patches_are_periodic_and_add_up():
    traction = np.zeros((16, 16))
    traction[6:9, 14:] = traction[6:9, :2] = 1.0
    traction[14:, 6:8] = traction[:1, 6:8] = 2.0
    traction[12, 12] = 4.0
    area, patches = patches_of(traction)
    assert sorted(patches.nodes) == [1, 6, 12]
    assert sorted(patches.force * 256) == pytest.approx([4.0, 12.0, 12.0])
    assert np.sum(patches.area) == pytest.approx(area, rel=1e-12)
    assert np.all((patches.area > 0) & (patches.area * 256 < patches.nodes))
    assert patches.label[6, 15] == patches.label[6, 0] != 0


def test_only_single_spots_are_matched_with_a_patch():
    traction = np.zeros((64, 64))
    for rows, columns in ((8, 8), (8, 24), (8, 26), (40, 8), (40, 40), (24, 50)):
        traction[rows - 2 : rows + 3, columns - 2 : columns + 3] = 1.0
    _, patches = patches_of(traction, 64.0)
    #          single     several     several    united     extra        missed: (24, 50) and (40, 40)
    centres = [(8.2, 8.1), (23.5, 8.0), (27.0, 8.0), (8.0, 40.0), (55.0, 55.0)]
    spots, under = match(np.array(centres), np.full(5, 1.8), np.array([0, 0, 0, 1, 0], bool), patches, 64.0)
    assert spots.tolist() == [0] and patches.label[8, 8] == under[0] + 1


def test_area_on_a_rotational_profile_of_fourth_order():
    """Boundary elements on a single summit against Sneddon's closed form."""
    grid, period, radius, fourth = 256, 4.0, 1.0, 0.35
    x = (np.arange(grid) - grid // 2) * (period / grid)
    r2 = np.minimum(x**2 + x[:, None] ** 2, 1.0)
    surface = icha.Surface(-r2 / (2 * radius) + fourth * r2**2, period)
    force = 8 / 3 * 0.35**3 * (1 - 3.2 * fourth * 0.35**2)
    contact = contact_of(surface, HARD)
    state = contact.equilibrium(contact.untouched(), -0.1, Control(PRESSURE, force / period**2))
    patches = contact_patches(contact, state)
    pair = xr.Dataset(
        {
            "pair_patch_area": ("pair", patches.area),
            "pair_patch_force": ("pair", patches.force),
            "pair_curvature_radius": ("pair", [radius]),
            "pair_fourth_order": ("pair", [fourth]),
            "contact_modulus": 2.0,
        }
    )
    assert float(shape_ratio(pair)[0]) == pytest.approx((1 - 3.2 * fourth * 0.35**2) ** (-2 / 3), rel=0.015)
    assert float(shape_ratio_of_fourth_order(pair)[0]) == pytest.approx(float(shape_ratio(pair)[0]), rel=0.015)


# --- the whole --------------------------------------------------------------------------------------------------


def test_single_spots_and_their_patches_are_part_of_the_contact(sources):
    area, nominal = sources["contact_area_fraction"], float(sources["period"]) ** 2
    for name, variant in (("pair_spot_area", "icha"), ("pair_patch_area", "boundary_elements")):
        per_state = [float(sources[name][sources["pair_reduced_pressure"] == p].sum()) for p in PRESSURES]
        most = area.sel(variant=variant) * nominal * (1 + 1e-12)  # rounding
        assert np.all((0 < np.array(per_state)) & (per_state <= most))


def test_effects_add_up_to_the_error(sources):
    area = sources["contact_area_fraction"]
    error = np.log(area.sel(variant="icha") / area.sel(variant="boundary_elements"))
    assert effects(sources).sum("source").values == pytest.approx(error.values, rel=1e-9)
    assert effects(sources).sizes["source"] == len(chain(sources)) - 1


def test_bars_of_the_figure_add_up_to_the_effects(sources):
    _, _, bars, spots = figure([sources, sources]).axes
    mean = effects(sources).values
    ends = np.array([[(bar.get_y(), bar.get_y() + bar.get_height()) for bar in each] for each in bars.containers])
    assert ends.min(axis=(0, 2)) == pytest.approx(np.minimum(mean, 0).sum(axis=0))
    assert ends.max(axis=(0, 2)) == pytest.approx(np.maximum(mean, 0).sum(axis=0))
    assert {line.get_label() for line in spots.lines} > {"boundary elements", "fourth-order term"}
