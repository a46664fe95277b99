"""Limits of runs that are known before they start: contact radii in cells, shortest waves, and Tabor parameters."""

import math

import numpy as np
import pytest

from icha.asperity.material import Material
from icha.path.targets import Path
from icha.references import indentation
from icha.references.limits import doubts, radius_at_target
from icha.surfaces.shapes import Cone, CylinderPunch, FlatPunch, Paraboloid, Sphere
from icha.surfaces.surface import Surface

SIDE, MODULUS = 200e-6, 1e6
BARE, STICKY = Material(MODULUS, 0.0), Material(MODULUS, 0.5e-3)


def surface(shape, grid=64, side=SIDE):
    return Surface(np.zeros((grid, grid)), side, "free", shape)


@pytest.mark.parametrize("material", [BARE, STICKY])
def test_contact_radii_of_spheres_are_those_of_hertz_and_jkr(material):
    radius = 5e-3
    for kind, value, law in (
        ("force", 1e-5, indentation.sphere_radius_at_force),
        ("indentation", 4e-7, indentation.sphere_radius_at_indentation),
        ("mean_separation", -4e-7, lambda d, *others: indentation.sphere_radius_at_indentation(-d, *others)),
        ("pressure", 250.0, lambda p, *others: indentation.sphere_radius_at_force(p * SIDE**2, *others)),
    ):
        exact = float(law(value, radius, MODULUS, material.surface_energy))
        for shape in (Sphere(radius), Paraboloid((radius, radius))):
            assert radius_at_target(shape, SIDE, material, kind, value) == pytest.approx(exact, rel=2e-3)


def test_contact_radii_of_other_shapes():
    slope = 1 / math.tan(1.4)
    assert radius_at_target(Cone(1.4), SIDE, BARE, "force", 1e-6) == pytest.approx(
        math.sqrt(2e-6 / (math.pi * MODULUS * slope)), rel=1e-3
    )
    assert radius_at_target(CylinderPunch(2e-5), SIDE, BARE, "force", 1e-6) == 2e-5
    assert radius_at_target(FlatPunch(4e-5), SIDE, BARE, "indentation", 1e-6) == 2e-5
    assert radius_at_target(Sphere(1e-3), SIDE, BARE, "contact_radius", 3e-6) == 3e-6
    assert radius_at_target(Sphere(1e-3), SIDE, BARE, "area_fraction", 0.01) == pytest.approx(SIDE * 0.1 / math.pi**0.5)
    assert radius_at_target(Sphere(1e-3), SIDE, BARE, "indentation", -1e-9) == 0


def test_coarse_grids_long_ranges_and_coarse_pull_offs_are_doubted():
    """The force on a punch with 8 cells in its radius is 0.765 of Kendall's (docs/indenter.md)."""
    punch, rubber = surface(CylinderPunch(50e-6), 64, 400e-6), Material(2.7e6, 0.05, 1e-9)
    (found,) = doubts(punch, rubber, Path(forces=[1e-4], unload=True), "boundary_elements")
    assert "has 8 cells: the computed force is about 24 % too small" in found
    assert doubts(punch, rubber, Path(forces=[1e-4]), "boundary_elements") == []
    (found,) = doubts(surface(Sphere(1e-3)), BARE, Path(indentations=[1e-7]), "boundary_elements")
    assert "3.2 cells per contact radius" in found
    glass, bead, path = Material(70e9, 0.05), surface(Sphere(10e-6), 96, 12e-6), Path(forces=[2e-3])
    (found,) = doubts(bead, glass, path, "boundary_elements")
    assert "Tabor parameter 0.34" in found and "17 %" in found and doubts(bead, glass, path, "asperities") == []
