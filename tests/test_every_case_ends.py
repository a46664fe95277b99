"""Surfaces, materials and paths at random: every sweep ends, converged or marked with its reason."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.analysis.checks import check_run

PERIOD = 100e-6
REASONS = (
    "the surface is sticky",
    "lies inside a jump",
    "the mean planes met",
    "beyond what the model covers",
    "no descent from an equilibrium error",
    "Newton steps",
)


@st.composite
def surfaces(draw):
    seed = draw(st.integers(0, 10**6))
    grid = draw(st.sampled_from([12, 16, 24, 32]))
    if draw(st.integers(0, 9)) == 0:
        # Every node its own: summits as close as they can be.
        return Surface(1e-6 * np.random.default_rng(seed).normal(size=(grid, grid)), PERIOD)
    waves = draw(st.floats(2.5, grid / 4))
    rolloff = draw(st.floats(1.01, waves))
    spectrum = SelfAffineSpectrum(
        PERIOD, PERIOD * rolloff / waves, PERIOD / waves, draw(st.floats(0.1, 1.0)), 10 ** draw(st.floats(-2.5, 0.5))
    )
    return spectrum.realise(grid, seed, draw(st.sampled_from(["fixed", "gaussian"])))


@st.composite
def cases(draw):
    surface = draw(surfaces())
    modulus = 10 ** draw(st.floats(4, 11))
    # Surface energy in units of what bends the summits flat, from nothing to far beyond it.
    strength = draw(st.one_of(st.just(0.0), st.floats(-5, 0.5).map(lambda power: 10**power)))
    energy = strength * modulus * surface.rms_height**1.5 * surface.rms_curvature**0.5
    tabor = 10 ** draw(st.floats(-0.7, 1.2))
    range_ = np.cbrt((energy / modulus) ** 2 / surface.rms_curvature) / tabor if energy else 1e-9
    kind = draw(st.sampled_from(["reduced_pressures", "area_fractions", "mean_separations"]))
    # Numbers a little apart, so that no two are equal.
    numbers = draw(st.lists(st.integers(0, 400), min_size=1, max_size=4, unique=True).map(sorted))
    if kind == "mean_separations":
        stops = [surface.rms_height * (4 - 0.0099 * n) for n in numbers]
    else:
        stops = [10 ** (-4.5 + 3.6 * n / 400) for n in numbers]
    snapshots = draw(st.sampled_from([None, [], [("area_fraction", 0.02)], [("reduced_pressure", 3e-3)]]))
    path = Path(**{kind: stops}, snapshots=snapshots, max_step=draw(st.sampled_from([0.05, 0.15, 0.5])))
    return surface, Material(modulus, energy, range_), path


def assert_sound(run):
    """Whatever a dataset holds is finite, converged and consistent."""
    for name, values in run.variables.items():
        if values.dtype.kind == "f":
            assert np.all(np.isfinite(values)), name
    assert np.all(run.residual <= 1e-8) and np.all(run.converged == 1)
    assert np.all((run.contact_area_fraction >= 0) & (run.contact_area_fraction <= 0.5))
    assert np.all(run.spot_radius > 0)
    adhesionless = float(run.surface_energy) == 0
    if adhesionless:
        assert np.all(run.nominal_pressure >= 0) and np.all(run.contact_stiffness >= 0)


@given(cases())
def test_every_sweep_ends_converged_or_marked(case):
    surface, material, path = case
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            run = simulate(surface, material, path)
        except ConvergenceError as error:
            reached = error.dataset.sizes["step"]
            assert error.dataset.attrs["incomplete"] == str(error)
            assert f"after {reached} of {len(path.targets)} stops" in str(error)
            assert reached < len(path.targets)
            assert any(reason in str(error) for reason in REASONS), str(error)
            run = error.dataset
        else:
            assert "incomplete" not in run.attrs
            assert run.sizes["step"] == len(path.targets)
            reached = {
                "reduced_pressure": run.reduced_pressure,
                "area_fraction": run.contact_area_fraction,
                "mean_separation": run.mean_separation,
            }
            for step in range(run.sizes["step"]):
                kind, target = str(run.step_kind[step].item()), float(run.step_target[step])
                assert float(reached[kind][step]) == pytest.approx(target, rel=1e-9)
    assert_sound(run)


@st.composite
def loops(draw):
    """There and back without adhesion on very small squares, periodic or free."""
    grid = draw(st.sampled_from([8, 10, 12, 16]))
    waves = draw(st.floats(1.2, grid / 4))
    spectrum = SelfAffineSpectrum(
        PERIOD, PERIOD, PERIOD / waves, draw(st.floats(0.1, 1.0)), 10 ** draw(st.floats(-2, 0))
    )
    heights = spectrum.realise(grid, draw(st.integers(0, 10**6)), draw(st.sampled_from(["fixed", "gaussian"]))).heights
    surface = Surface(heights, PERIOD, draw(st.sampled_from(["periodic", "free"])))
    kind = draw(st.sampled_from(["reduced_pressures", "area_fractions", "mean_separations"]))
    if kind == "mean_separations":
        stops = [surface.rms_height * draw(st.floats(2.5, 5)), surface.rms_height * draw(st.floats(0.5, 2.4))]
    else:
        stops = [10 ** draw(st.floats(-4, -1))]
    return surface, Path(**{kind: stops}, unload=True, max_step=draw(st.sampled_from([0.05, 0.15, 0.5])))


def assert_loop_is_sound(case):
    surface, path = case
    try:
        run = simulate(surface, Material(1e6, 0.0, 1e-9), path)
    except ValueError as error:
        assert "summits" in str(error)
    except ConvergenceError as error:
        assert any(reason in str(error) for reason in REASONS), str(error)
    else:
        assert not [check for check in check_run(run) if not check.passed]


@given(loops())
def test_loops_without_adhesion_pass_their_checks(case):
    assert_loop_is_sound(case)


@pytest.mark.slow
@settings(max_examples=1000)
@given(loops())
def test_a_thousand_loops_without_adhesion_pass_their_checks(case):
    assert_loop_is_sound(case)


def test_a_cycle_begins_at_its_highest_stop():
    surface = SelfAffineSpectrum(PERIOD, PERIOD / 2, PERIOD / 5, 0.8, 0.2).realise(32, 1)
    stops = [surface.rms_height * height for height in (4.5, 4.0, 2.0)]
    for energy in (0.0, 2e-3):
        run = simulate(surface, Material(0.24e6, energy, 2e-9), Path(mean_separations=stops, unload=True))
        assert [float(u) for u in run.mean_separation[:2]] == stops[:2]
        assert np.all(np.diff(run.mean_separation[run.leg == 0]) < 0)
        assert not [check for check in check_run(run) if not check.passed]


@pytest.mark.parametrize("strength", [1.0, 3.0, 10.0])
def test_a_sticky_surface_is_called_sticky(strength):
    # More surface energy than it takes to press the summits flat.
    surface = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 8, 0.8, 0.2).realise(64, 1)
    modulus = 1e6
    energy = strength * modulus * surface.rms_height**1.5 * surface.rms_curvature**0.5
    range_ = np.cbrt((energy / modulus) ** 2 / surface.rms_curvature) / 3
    with pytest.raises(ConvergenceError, match="the surface is sticky") as caught:
        simulate(surface, Material(modulus, energy, range_), Path(reduced_pressures=[1e-3, 1e-2]))
    assert re.search(r"after 0 of 2 stops", str(caught.value))
    assert "sticky" in caught.value.dataset.attrs["incomplete"]
