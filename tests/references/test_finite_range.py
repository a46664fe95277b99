"""Boundary elements at finite ranges against exact solutions."""

import os
import subprocess
import sys

import numpy as np
import pytest
import small_rough_solution
from digests import digest
from small_rough_solution import MATERIALS, PRESSURE

from icha.asperity.cohesive_zone import longest_spacing, strength_number
from icha.asperity.material import Material
from icha.references.finite_range import DEFAULT_TOLERANCE, GapContact, NotSolved, contact_state, finite_range_solution
from icha.surfaces.surface import Surface
from validation.surfaces import paraboloid

HERTZ = MATERIALS["hertz"]


def displacement(state, contact_modulus):
    """Displacement (m), of zero mean, by a state's traction: 2/(E* q) mode by mode."""
    n = len(state.traction)
    k = 2 * np.pi / state.surface.period
    q = k * np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    q[0, 0] = np.inf
    return np.fft.irfft2(2 / (contact_modulus * q) * np.fft.rfft2(state.traction), s=(n, n))


def wavy(grid, dimensions):
    """cos(x) on a cell of 2 pi, in one direction or in both, of amplitude 1/100 m."""
    wave = np.cos(np.arange(grid) * 2 * np.pi / grid)
    return Surface(0.01 * (wave[:, None] + wave if dimensions == 2 else np.tile(wave, (grid, 1))), 2 * np.pi)


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_wavy_surface_is_westergaards(share):
    """Strips of half-width a: p/p* = sin^2(pi a/lambda), p* = pi E* amplitude/lambda; peak 2 p/sin(pi a/lambda).

    H. M. Westergaard, J. Appl. Mech. 6 (1939) A49.
    """
    surface = wavy(256, 1)
    full = HERTZ.contact_modulus * 0.01 / 2
    state = contact_state(surface, HERTZ, share * full / (HERTZ.contact_modulus * surface.rms_slope))
    # Strips along the grid have no corners: their nodes are counted as they are, to one on each side.
    assert state.contact.mean() == pytest.approx(2 / np.pi * np.arcsin(np.sqrt(share)), abs=2 / 256)
    assert state.traction.max() == pytest.approx(2 * share * full / np.sqrt(share), rel=4e-3)


def test_full_contact_is_johnsons():
    """Full contact of cos(x) + cos(y) from sqrt(2)... on: pressure p - E* q/2 times the modes of the surface.

    K. L. Johnson, J. A. Greenwood and J. G. Higginson, Int. J. Mech. Sci. 27 (1985) 383.
    """
    surface = wavy(64, 2)
    flattening = HERTZ.contact_modulus / 2 * surface.heights
    pressure = 1.1 * np.abs(flattening).max()
    solution = finite_range_solution(surface, HERTZ, pressure / (HERTZ.contact_modulus * surface.rms_slope))
    state = contact_state(surface, HERTZ, pressure / (HERTZ.contact_modulus * surface.rms_slope))
    assert solution.contact_area_fraction == solution.contact_area_fraction_raw == 1
    np.testing.assert_allclose(state.traction, pressure + flattening, rtol=0, atol=1e-6 * pressure)


def test_perimeter_correction_takes_the_excess_of_hertzian_areas_away():
    """Of circles of 16 nodes in radius the nodes count 2 % too much, the corrected areas on average nothing."""
    surface, hertz = paraboloid(256, 12.0, offset=0.37), Material(1.0, 0.0, 1.0)
    raw, corrected = [], []
    for radius in np.linspace(0.7, 0.8, 5):
        reduced = 4 / 3 * radius**3 / surface.period**2 / surface.rms_slope
        solution = finite_range_solution(surface, hertz, reduced)
        exact = np.pi * radius**2 / surface.period**2
        raw.append(float(solution.contact_area_fraction_raw) / exact - 1)
        corrected.append(float(solution.contact_area_fraction) / exact - 1)
        edges = float(solution.contact_perimeter) / float(solution.spacing)
        assert edges == pytest.approx(8 * radius / float(solution.spacing), rel=0.06)
    assert np.mean(raw) > 0.01
    assert abs(np.mean(corrected)) < 0.005


@pytest.fixture(scope="module", params=["hertz", "adhesive"])
def rough(request):
    """A small rough surface with and without adhesion, one of its states, and the dataset of the same."""
    surface, material = small_rough_solution.surface(), MATERIALS[request.param]
    state = contact_state(surface, material, PRESSURE, refinement=2)
    return surface, material, state, finite_range_solution(surface, material, PRESSURE, refinement=2, seed=3)


def test_state_is_in_equilibrium(rough):
    """Gap and traction belong together, and to the law of the interface, by Fourier transforms written down here."""
    surface, material, state, _ = rough
    unit = material.contact_modulus * surface.rms_slope
    gap = displacement(state, material.contact_modulus) - state.surface.heights + state.mean_separation
    np.testing.assert_allclose(gap, state.gap, rtol=0, atol=1e-5 * surface.rms_height)
    assert np.all(state.gap > -1e-5 * surface.rms_height)
    pull = material.surface_energy / material.interaction_range
    outside = ~state.contact
    attraction = -pull * np.exp(-state.gap[outside] / material.interaction_range)
    np.testing.assert_allclose(state.traction[outside], attraction, rtol=0, atol=1e-5 * unit)
    assert np.all(state.traction[state.contact] >= -pull - 1e-5 * unit)
    assert np.all(state.gap[state.contact] < 1e-5 * surface.rms_height)


def test_identities_of_the_dataset(rough):
    surface, material, state, solution = rough
    raw = float(solution.contact_area_fraction_raw)
    gaps = solution.gap_density.values * np.diff(solution.gap_bin_edges)
    areas = solution.pressure_density.values * np.diff(solution.pressure_bin_edges)
    assert gaps.sum() + raw == pytest.approx(1, rel=1e-12)
    assert areas.sum() == pytest.approx(raw, rel=1e-12)
    load = np.sum(areas * solution.pressure_bin_mean.values) + float(solution.outside_pressure)
    assert load == pytest.approx(float(solution.nominal_pressure), rel=1e-9)
    assert solution.contact.mean() == pytest.approx(raw, rel=1e-12)
    assert solution.contact.shape == (96, 96)
    assert solution.spacing == pytest.approx(surface.period / 96)
    assert solution.mean_separation == pytest.approx(state.gap.mean())
    attraction = np.exp(-state.gap / material.interaction_range) if material.surface_energy else state.contact
    assert solution.energetic_area_fraction == pytest.approx(attraction.mean(), rel=1e-6)
    assert (solution.outside_pressure < 0) == (material.surface_energy > 0)
    assert all(np.all(np.isfinite(variable)) for variable in solution.data_vars.values())
    assert all({"units", "long_name"} <= set(variable.attrs) for variable in solution.variables.values())
    np.testing.assert_array_equal(solution.contact, state.contact)


def test_energetic_area_is_the_derivative_of_the_energy():
    """The work of approach from afar is the energy, whose derivative to dgamma is minus the energetic area.

    Between two ranges of dgamma, at one mean gap: E = elastic energy - dgamma A0 mean(exp(-u/rho)).
    """
    surface, material = small_rough_solution.surface(), MATERIALS["adhesive"]
    separation = 1.5 * surface.rms_height

    def energy(change):
        softer = Material(material.contact_modulus, material.surface_energy * (1 + change), material.interaction_range)
        state = GapContact(surface, softer, DEFAULT_TOLERANCE).solve(separation)
        elastic = 0.5 * np.mean(state.traction * displacement(state, softer.contact_modulus))
        return elastic - softer.surface_energy * state.energetic_area_fraction(softer)

    step = 0.02
    slope = (energy(step) - energy(-step)) / (2 * step * material.surface_energy)
    state = GapContact(surface, material, DEFAULT_TOLERANCE).solve(separation)
    assert slope == pytest.approx(-state.energetic_area_fraction(material), rel=1e-3)


def test_range_that_the_grid_does_not_resolve_is_refused_with_the_numbers():
    surface = small_rough_solution.surface()
    short = Material(25e6, 0.05, 2.071e-9)
    with pytest.raises(ValueError, match=r"^interaction_range: a range of 2\.071e-09 m is not resolved") as refused:
        finite_range_solution(surface, short, PRESSURE)
    strength = f"{strength_number(short, surface.spacing):.3g}"
    numbers = (f"{longest_spacing(short):.3g}", strength, f"{surface.spacing:.4g}")
    assert all(number in str(refused.value) for number in numbers)


@pytest.mark.parametrize(("name", "value"), [("reduced_pressure", 0.0), ("refinement", 1.5), ("tolerance", -1.0)])
def test_wrong_arguments_are_named(name, value):
    arguments = {"reduced_pressure": PRESSURE} | {name: value}
    with pytest.raises(ValueError, match=f"^{name}: "):
        finite_range_solution(small_rough_solution.surface(), MATERIALS["hertz"], **arguments)


@pytest.mark.parametrize(
    ("limit", "most", "material", "message"),
    [
        ("_MAX_ITERATIONS", 3, "hertz", r"did not converge: error .*, tolerance 1e-08"),
        ("_MAX_SOLVES", 1, "adhesive", "no mean gap was found at which the contact carries the load: after 1 attempts"),
    ],
)
def test_states_that_are_not_found_are_errors(limit, most, material, message, monkeypatch):
    monkeypatch.setattr(f"icha.references.finite_range.{limit}", most)
    with pytest.raises(NotSolved, match=message):
        finite_range_solution(small_rough_solution.surface(), MATERIALS[material], PRESSURE)


def test_same_bytes_in_another_process_with_more_threads():
    here = finite_range_solution(small_rough_solution.surface(), MATERIALS["adhesive"], PRESSURE)
    other = subprocess.run(
        [sys.executable, small_rough_solution.__file__],
        env=os.environ | {"OMP_NUM_THREADS": "2"},
        check=True,
        capture_output=True,
        text=True,
    )
    assert other.stdout.strip() == digest(here)
