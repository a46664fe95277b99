"""Rigid shapes: heights against their definitions, curvatures at the apex, slopes, and refused parameters."""

import math

import numpy as np
import pytest

from icha.surfaces.shapes import SHAPES, Cone, CylinderPunch, FlatPunch, Paraboloid, Sphere, Wave

SMOOTH = [Sphere(1e-3), Paraboloid((1e-3, 1e-3)), Wave(1e-3, 2e-7, 3e-5), Wave(1e-3, -2e-7, 3e-5)]


@pytest.mark.parametrize("shape", [*SMOOTH, Cone(1.4), CylinderPunch(1e-5), FlatPunch(1e-5)])
def test_apex_has_height_zero(shape):
    assert shape.heights(0.0, 0.0) == 0.0
    assert shape.heights(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)


def test_points_of_a_sphere_have_the_distance_of_its_radius_from_the_centre():
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 100))
    np.testing.assert_allclose(np.sqrt(x**2 + y**2 + (Sphere(1.0).heights(x, y) + 1.0) ** 2), 1.0, rtol=1e-14)
    # Close to the apex, rounding must not destroy the height.
    assert Sphere(1e-3).heights(1e-12, 0.0) == pytest.approx(-(1e-12**2) / 2e-3, rel=1e-12)


def test_points_beside_a_sphere_are_refused():
    with pytest.raises(ValueError, match=r"radius: 0\.001 m is less than the distance of 0\.00141421 m .* larger"):
        Sphere(1e-3).heights(np.array([0.0, 1e-3]), np.array([0.0, 1e-3]))


def test_paraboloid_has_the_radii_of_curvature_along_its_axes():
    shape = Paraboloid([2e-3, 5e-3])
    assert shape.heights(1e-5, 0.0) == pytest.approx(-(1e-5**2) / (2 * 2e-3), rel=1e-14)
    assert shape.heights(0.0, 1e-5) == pytest.approx(-(1e-5**2) / (2 * 5e-3), rel=1e-14)
    assert shape.sphere_radius == pytest.approx(math.sqrt(10) * 1e-3, rel=1e-14)


def test_punches_exist_inside_their_edges_only():
    x = np.array([0.0, 0.9, 1.1, 0.8]) * 1e-6
    y = np.array([0.0, 0.0, 0.0, 0.8]) * 1e-6
    assert list(CylinderPunch(1e-6).heights(x, y)) == [0, 0, -np.inf, -np.inf]
    assert list(FlatPunch(2e-6).heights(x, y)) == [0, 0, -np.inf, 0]


def test_cone_descends_by_the_cotangent_of_its_half_angle():
    assert Cone(math.radians(45)).heights(3.0, 4.0) == pytest.approx(-5.0, rel=1e-14)
    assert Cone(math.radians(80)).heights(0.0, 1.0) == pytest.approx(-math.tan(math.radians(10)), rel=1e-14)


def test_waves_repeat_below_the_paraboloid_and_a_trough_lies_in_the_centre_if_the_amplitude_is_negative():
    crest, trough = Wave(1e-3, 2e-7, 3e-5), Wave(1e-3, -2e-7, 3e-5)
    paraboloid = Paraboloid((1e-3, 1e-3))
    assert crest.heights(6e-5, 0.0) == pytest.approx(paraboloid.heights(6e-5, 0.0), rel=1e-12)
    half = paraboloid.heights(0.0, 1.5e-5)
    assert crest.heights(0.0, 1.5e-5) == pytest.approx(half - 4e-7, rel=1e-12)
    assert trough.heights(0.0, 1.5e-5) == pytest.approx(half + 4e-7, rel=1e-12) and half + 4e-7 > 0


@pytest.mark.parametrize("shape", [Sphere(1e-3), Cone(1.4), *SMOOTH[2:]])
def test_slope_is_the_derivative_of_the_height(shape):
    r, step = np.linspace(1e-5, 3e-4, 7), 1e-9
    difference = (shape.heights(r - step, 0.0) - shape.heights(r + step, 0.0)) / (2 * step)
    np.testing.assert_allclose(shape.slope(r), difference, rtol=1e-6)


def test_only_rounded_shapes_have_the_radius_of_a_sphere():
    assert [shape.sphere_radius for shape in SMOOTH] == pytest.approx([1e-3] * 4, rel=1e-14)
    assert all(shape.sphere_radius is None for shape in (Cone(1.0), CylinderPunch(1.0), FlatPunch(1.0)))


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("sphere", {"radius": 0.0}, "radius: 0.0 must be a number in"),
        ("sphere", {"radius": "1 mm"}, "radius: '1 mm' is not a number"),
        ("paraboloid", {"radii": 1e-3}, "radii: 0.001 must be two lengths in m"),
        ("paraboloid", {"radii": (1e-3, -1e-3)}, "radii: -0.001 must be"),
        ("cylinder_punch", {"radius": math.inf}, "radius: inf is not finite"),
        ("flat_punch", {"side": -1e-6}, "side: -1e-06 must be"),
        ("cone", {"half_angle": math.pi / 2}, "half_angle: 1.57.* must be a number in .* \\(in rad\\)"),
        ("wave", {"radius": 1e-3, "amplitude": math.nan, "wavelength": 1e-5}, "amplitude: nan is not finite"),
        ("wave", {"radius": 1e-3, "amplitude": 1e-9, "wavelength": 0}, "wavelength: 0.0 must be"),
    ],
)
def test_invalid_parameters_are_refused_by_name(name, values, message):
    with pytest.raises(ValueError, match=message):
        SHAPES[name](**values)


def test_shapes_are_immutable_values():
    assert Sphere(1) == Sphere(1.0) and hash(Sphere(1e-3)) == hash(Sphere(1e-3))
    assert hash(Paraboloid([1, 2])) == hash(Paraboloid((1.0, 2.0)))
