"""Invariances of both models on random contacts: units, position and direction, range, threads."""

import numpy as np
import pytest
from digests import digest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.contact.models import DEFAULT_MODEL, REFERENCE_MODEL
from icha.support import parallel

PERIOD, MODULUS = 100e-6, 25e6
# Grid and shortest waves along its side: some fifty asperities, and eight cells for each wave.
SIZE = {DEFAULT_MODEL: (64, 16), REFERENCE_MODEL: (32, 4)}
# Largest difference of two equilibria, relative and in h_rms. Asperities rest to 1e-9 h_rms, fronts of boundary
# elements to 1e-9 of sqrt(G/dgamma); loads and areas change by up to a hundred times themselves per h_rms, and next to
# a jump by more.
SAME = {DEFAULT_MODEL: 1e-7, REFERENCE_MODEL: 1e-5}
# Unions of asperities remember where they happened, which steps decide. Of few spots that is so much of their area.
STEPS_WITH_UNIONS = 0.1
COUNTS = ("spot_count", "jump_in_count", "jump_off_count", "coalescence_count", "split_count")
# Powers of ten of the energy of adhesion, in units of what it takes to press the summits flat; None: no adhesion.
NONE, ADHERING = st.none(), st.floats(-4, -1.5)
ANY = st.one_of(NONE, ADHERING)
BOTH = pytest.mark.parametrize("model", [DEFAULT_MODEL, REFERENCE_MODEL])


# Each case computes two runs or more, so only one in twenty of the random cases of other tests is tried.
SOME = settings(max_examples=max(settings.default.max_examples // 20, 2))


@st.composite
def contacts(draw, model, adhesion=ANY):
    """A surface and a material."""
    grid, waves = SIZE[model]
    hurst, slope = draw(st.floats(0.3, 1.0)), 10 ** draw(st.floats(-2, 0))
    spectrum = SelfAffineSpectrum(PERIOD, PERIOD / draw(st.floats(1, waves / 2)), PERIOD / waves, hurst, slope)
    surface = spectrum.realise(grid, draw(st.integers(0, 10**6)))
    return surface, adhering(surface, draw(adhesion), draw(st.floats(1, 5)))


def adhering(surface, power, tabor):
    """A material, with a power of ten of the energy that it takes to press the summits flat."""
    if power is None:
        return Material(MODULUS, 0.0, 1e-9)
    energy = 10**power * MODULUS * surface.rms_height**1.5 * surface.rms_curvature**0.5
    return Material(MODULUS, energy, np.cbrt((energy / MODULUS) ** 2 / surface.rms_curvature) / tabor)


def pressed(surface, material, model, **path):
    """The run; of one that ends early what it reached, which must be something."""
    try:
        run = simulate(surface, material, Path(**({"reduced_pressures": [3e-3, 2e-2]} | path)), model=model)
    except ConvergenceError as error:
        run = error.dataset
    assume(run.sizes["step"])
    return run


def assert_same(one, other, bound, counts=COUNTS):
    """Assert that two runs are the same without their units, as accurately as their equilibria are known."""
    assert one.sizes["step"] == other.sizes["step"], (one.attrs.get("incomplete"), other.attrs.get("incomplete"))
    for name in ("contact_area_fraction", "reduced_pressure"):
        np.testing.assert_allclose(other[name], one[name], rtol=bound, err_msg=name)
    np.testing.assert_allclose(other["reduced_separation"], one["reduced_separation"], atol=bound)
    for name in counts:
        np.testing.assert_array_equal(other[name], one[name], err_msg=name)


def scaled(surface, material, length, stress):
    """The same contact with all lengths by one factor, the modulus by another, the energy by both."""
    energy = material.surface_energy * stress * length
    return Surface(surface.heights * length, PERIOD * length), Material(
        MODULUS * stress, energy, material.interaction_range * length
    )


@BOTH
@SOME
@given(st.data(), st.floats(-4, 4), st.floats(-3, 3))
def test_units_drop_out(model, data, lengths, pressures):
    contact, length, stress = data.draw(contacts(model)), 10**lengths, 10**pressures
    one, other = (pressed(*each, model) for each in (contact, scaled(*contact, length, stress)))
    assert_same(one, other, SAME[model])
    np.testing.assert_allclose(
        other["contact_stiffness"], stress / length * one["contact_stiffness"], rtol=100 * SAME[model]
    )


@BOTH
@SOME
@given(st.data(), st.tuples(st.integers(0, 63), st.integers(0, 63)), st.integers(0, 3), st.booleans())
def test_place_and_direction_of_the_surface_change_nothing(model, data, shift, turns, mirrored):
    surface, material = data.draw(contacts(model))
    heights = np.rot90(np.roll(surface.heights, shift, axis=(0, 1)), turns)
    moved = Surface(heights.T if mirrored else heights, PERIOD)
    assert_same(pressed(surface, material, model), pressed(moved, material, model), SAME[model])


@BOTH
@SOME
@given(st.data(), st.floats(-6, 6))
def test_without_adhesion_the_range_changes_no_bit(model, data, power):
    surface, material = data.draw(contacts(model, NONE))
    other = Material(MODULUS, 0.0, material.interaction_range * 10**power)
    without = ["interaction_range", "tabor_parameter"]
    assert digest(pressed(surface, material, model), without) == digest(pressed(surface, other, model), without)


@BOTH
@SOME
@given(st.data(), st.floats(-12, 0))
def test_heights_scale_apart_from_lengths(model, data, power):
    """With heights scale approaches and pressures; the adhesive part of an approach does if the energy is squared."""
    surface, material = data.draw(contacts(model))
    factor = 10**power
    flatter = Surface(surface.heights * factor, PERIOD)
    scaled = Material(MODULUS, material.surface_energy * factor**2, material.interaction_range * factor)
    assert_same(pressed(surface, material, model), pressed(flatter, scaled, model), SAME[model])


@SOME
@given(contacts(DEFAULT_MODEL, NONE))
def test_adhesion_vanishes_with_its_energy(contact):
    """An approach is less than Hertz's by sqrt(2 pi a dgamma/E*): what it changes falls with the root of the energy."""
    surface, bare = contact
    expected, unit = pressed(surface, bare, DEFAULT_MODEL), surface.rms_height**1.5 * surface.rms_curvature**0.5
    faint = [pressed(surface, Material(MODULUS, part * MODULUS * unit, 1e-9), DEFAULT_MODEL) for part in (1e-8, 1e-12)]
    error = [float(np.abs(run["contact_area_fraction"] / expected["contact_area_fraction"] - 1).max()) for run in faint]
    if expected["coalescence_count"].max() == 0:
        assert error[0] <= 1e-2 and error[1] <= 0.2 * error[0] + SAME[DEFAULT_MODEL]
    assert error[1] <= STEPS_WITH_UNIONS


@BOTH
@SOME
@given(st.data())
def test_threads_change_no_bit(model, data):
    surface, material = data.draw(contacts(model))
    found = set()
    with pytest.MonkeyPatch.context() as patch:
        # Asperities work on small grids by threads, as on large ones.
        patch.setattr(parallel, "LARGE_GRID", 0)
        for threads in ("1", "3"):
            patch.setenv("OMP_NUM_THREADS", threads)
            again = Surface(surface.heights, PERIOD)
            found.add(digest(pressed(again, material, model)))
    assert len(found) == 1
