"""Single indenters on a free half-space against closed forms, at small size (docs/indenter.md: at full)."""

import math

import numpy as np
import pytest

from icha import Material, Surface
from icha.boundary_elements.contact import contact_of
from icha.surfaces.shapes import CylinderPunch
from validation.single_contacts import force_and_area, largest_tension


def punch(cells, material):
    """Contact of a flat punch of radius 1 m."""
    grid = 4 * cells
    return contact_of(Surface(np.zeros((grid, grid)), 4.0, "free", CylinderPunch(1.0)), material)


def test_flat_punch_has_the_stiffness_of_boussinesq():
    contact = punch(8, Material(1.0, 0.0, 1e-4))
    state = contact.equilibrium(contact.untouched(), -0.01)
    assert force_and_area(contact, state)[0] == pytest.approx(2 * 0.01, rel=0.015)


def test_flat_punch_breaks_off_at_the_force_of_kendall():
    """The front has half of its width at a sharp edge: the face seems smaller by 1.2 to 1.5 cells."""
    contact = punch(12, Material(1.0, 1e-4, 1e-4))
    state = contact.relax_region(np.isfinite(contact.crop(contact.heights)), 5e-4)
    tension, _ = largest_tension(contact, state, 2.5e-3)
    smaller = (tension / math.sqrt(8 * math.pi * 1e-4)) ** (2 / 3)
    assert 1.2 < 12 * (1 - smaller) < 1.5
