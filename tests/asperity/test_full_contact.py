"""Energy of full contact, and the applicability of the asperity model that follows from it."""

import math

import numpy as np
import pytest
from scipy.special import ndtr

import icha
from icha.asperity.full_contact import full_contact_energy_ratio
from icha.asperity.material import Material
from icha.asperity.stickiness import sticky_rms_height
from icha.datasets.campaign import select_run
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_run, write_dataset
from icha.datasets.format import RUN, problems_with_file
from icha.half_space.layer import Layer
from icha.surfaces.moments import self_affine_full_contact

L, A = 3e-6, 1e-8


@pytest.mark.parametrize("waves", [(1, 0), (0, 3), (2, 3)])
def test_a_single_wave_takes_a_quarter_of_the_wave_number_times_its_mean_square(waves):
    x = np.arange(32) * L / 32
    k = 2 * np.pi / L * np.array(waves)
    surface = icha.Surface(A * np.cos(k[0] * x[None, :] + k[1] * x[:, None]), L)
    assert surface.full_contact_energy == pytest.approx(np.hypot(*k) * A**2 / 8)


@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_a_layer_stiffens_a_wave_by_its_compliance(poisson):
    """Energy q Delta^2/(8 phi) and largest tension q Delta/(2 phi), divided by E*; phi by Johnson (1985), sec. 13.5."""
    q, a = 2 * np.pi / L, 2 * np.pi / 10
    phi = ((3 - 4 * poisson) * np.sinh(2 * a) - 2 * a) / (
        (3 - 4 * poisson) * np.cosh(2 * a) + 2 * a**2 + 5 - 12 * poisson + 8 * poisson**2
    )
    wave = icha.Surface(A * np.cos(q * np.arange(32) * L / 32)[None, :] + np.zeros((32, 1)), L)
    found = wave.full_contact(Layer(L / 10, poisson).factor)
    assert found == pytest.approx((q * A**2 / (8 * phi), q * A / (2 * phi)))


def test_a_free_square_has_the_energy_of_its_mirror_images():
    x = (np.arange(32) + 0.5) * L / 32
    heights = A * np.cos(3 * np.pi / L * x)[None, :] * np.cos(2 * np.pi / L * x)[:, None]
    expected = np.sqrt(13) * np.pi / L * A**2 / 16
    assert icha.Surface(heights, L, "free").full_contact_energy == pytest.approx(expected)
    heights = np.random.default_rng(1).normal(size=(24, 24))
    mirrored = np.block([[heights, heights[:, ::-1]], [heights[::-1], heights[::-1, ::-1]]])
    expected = icha.Surface(mirrored, 2 * L).full_contact_energy
    assert icha.Surface(heights, L, "free").full_contact_energy == pytest.approx(expected)


@pytest.mark.parametrize("thickness", [math.inf, 10e-6, 1e-6])
@pytest.mark.parametrize(
    "lengths",
    [(100e-6, 20e-6, 1.5625e-6, 0.8), (100e-6, 50e-6, 1e-6, 0.3), (90e-6, 90e-6, 30e-6, 0.8), (1e-3, 8e-6, 6e-6, 0.5)],
)
def test_of_a_self_affine_surface_it_is_known_without_making_one(lengths, thickness):
    grid = math.ceil(2 * lengths[0] / lengths[2]) + 2
    with pytest.warns(UserWarning, match="cells per shortest"):
        surface = icha.SelfAffineSpectrum(*lengths).realise(grid, 1)
    softness = Layer(thickness, 0.4).factor if thickness < math.inf else None
    exact = surface.full_contact(softness).energy
    assert self_affine_full_contact(*lengths, softness).energy == pytest.approx(exact, rel=1e-3)


def test_the_ratio_of_a_sticky_silicone_is_known():
    spectrum = icha.SelfAffineSpectrum(40e-6, 10e-6, 0.2e-6, 0.8)
    energy = self_affine_full_contact(40e-6, 10e-6, 0.2e-6, 0.8).energy * (100e-9 / spectrum.rms_height) ** 2
    assert full_contact_energy_ratio(energy, 2.667e6, 0.05) == pytest.approx(0.138, abs=5e-4)
    assert full_contact_energy_ratio(energy, 2.667e6, 0.0) == math.inf


def pressed(energy, **path):
    surface = icha.SelfAffineSpectrum(100e-6, 40e-6, 14.3e-6, 0.8).realise(32, 1)
    material = icha.Material(0.3e6, energy, 8e-9)
    try:
        return icha.simulate(surface, material, icha.Path(**path))
    except icha.ConvergenceError as error:
        return error.dataset


def test_an_infinite_ratio_is_a_value_of_every_file(tmp_path):
    sticky, run = (pressed(energy, reduced_pressures=[1e-2]) for energy in (0.5, 0.0))
    assert float(sticky["full_contact_energy_ratio"]) == pytest.approx(0.698, abs=1e-3)
    assert "more than 0.014: adhesion unites neighbouring spots (U_full" in sticky.attrs["applicability"]
    assert np.isposinf(run["full_contact_energy_ratio"]) and run.attrs["applicability"] == ""
    write_dataset(run, tmp_path / "run.nc")
    back = read_run(tmp_path / "run.nc")
    assert np.isposinf(back["full_contact_energy_ratio"]) and not [
        flaw for flaw in problems_with_file(RUN, back) if "finite" in flaw
    ]
    labels = ("one", "asperities", "rough", -1, 1.0, "bare")
    for source in (run, tmp_path / "run.nc"):
        tree = campaign_tree([(labels, source)])
        assert np.isposinf(select_run(tree, labels)["full_contact_energy_ratio"])
    with pytest.raises(ValueError, match="'full_contact_energy_ratio' holds 1 of 1 values that are not finite"):
        write_dataset(run.assign(full_contact_energy_ratio=-run["full_contact_energy_ratio"]), tmp_path / "no.nc")
    with pytest.raises(ValueError, match="'stickiness' holds 1 of 1 values that are not finite"):
        write_dataset(run.assign(stickiness=run["stickiness"] + np.inf), tmp_path / "no.nc")


@pytest.mark.parametrize("boundary", ["periodic", "free"])
def test_a_wave_is_complete_at_johnsons_pressure(boundary):
    """pi E* Delta/lambda, K. L. Johnson, Int. J. Solids Struct. 32 (1995) 423; a free square ends at crests here."""
    at = np.arange(64) / 64 if boundary == "periodic" else (np.arange(64) + 0.5) / 64
    wave = icha.Surface(1e-6 * np.add.outer(np.cos(2 * np.pi * at), np.zeros(64)), 10e-6, boundary)
    assert wave.full_contact().complete_pressure == pytest.approx(np.pi / 10, rel=2e-3)


@pytest.mark.parametrize(("rolloff", "waves", "hurst"), [(5, 64, 0.8), (4, 16, 0.8), (1, 33, 0.5)])
def test_estimate_of_the_pressure_for_complete_contact(rolloff, waves, hurst):
    """Within a tenth of the mean of eight realisations on half-spaces, and within a fifth on layers."""
    lengths = 1e-4, 1e-4 / rolloff, 1e-4 / waves, hurst
    surfaces = [icha.SelfAffineSpectrum(*lengths, rms_slope=1.0).realise(8 * waves, seed) for seed in range(1, 9)]
    for softness, error in ((None, 0.1), *((Layer(1e-6, poisson).factor, 0.2) for poisson in (0.3, 0.5))):
        pressures = [surface.full_contact(softness).complete_pressure for surface in surfaces]
        estimate = self_affine_full_contact(*lengths, softness).complete_pressure
        assert estimate == pytest.approx(np.mean(pressures), rel=error)


def test_a_flaw_lowers_the_strength_to_that_of_a_penny_shaped_crack():
    """The stress intensity 2 sigma sqrt(a/pi) of the crack then has the energy release rate K^2/(2 E*) = dgamma."""
    modulus, energy, radius = 2e6, 0.05, 1e-6
    strength = icha.Material(modulus, energy, 2e-9, radius).interface_strength
    assert (2 * strength * math.sqrt(radius / math.pi)) ** 2 / (2 * modulus) == pytest.approx(energy)
    # A flaw smaller than the range of attraction does not weaken the interface.
    flawless = icha.Material(modulus, energy, 2e-9).interface_strength
    assert icha.Material(modulus, energy, 2e-9, 1e-11).interface_strength == flawless
    with pytest.raises(ValueError, match="flaw_radius"):
        icha.Material(modulus, energy, 2e-9, -1e-6)


def test_attraction_exceeds_repulsion_below_the_height_of_the_bearing_area_model():
    """The bearing area within a small range, under the tension dgamma/range, pulls against Persson's repulsion."""
    material, wavelength = Material(2e6, 0.05, 1e-11), 10e-6
    limit = sticky_rms_height(wavelength, material)

    def excess(height):
        u = np.linspace(0.5, 4, 20_000) * height
        area = ndtr(-(u - material.interaction_range) / height) - ndtr(-u / height)
        pull = area * material.surface_energy / material.interaction_range
        push = 0.75 * 2 * np.pi / wavelength * height * material.contact_modulus * np.exp(-2 * u / height)
        return np.max(pull / push)

    assert excess(limit * 0.999) > 1 > excess(limit * 1.001)
