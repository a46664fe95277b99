"""Section `materials`."""

import pytest

BAD = {
    # key, value, what the message must say of it
    "unknown key": ("materials.soft.modulus", "25 MPa", "materials.soft.modulus: unknown key"),
    "missing key": ("materials.soft.surface_energy", None, "materials.soft.surface_energy: the key is missing"),
    "missing unit": ("materials.soft.contact_modulus", 25e6, "the unit is missing; allowed: pressure with its unit"),
    "wrong dimension": ("materials.soft.surface_energy", "50 mJ/m^3", "is not a unit of energy per area"),
    "negative modulus": ("materials.soft.contact_modulus", "-25 MPa", "'-25 MPa' is out of range"),
    "zero modulus": ("materials.soft.contact_modulus", "0 MPa", "in [1e-9, 1e15] Pa"),
    "negative surface energy": ("materials.soft.surface_energy", "-1 mJ/m^2", "in [0, 1e24] J/m^2"),
    "zero range": ("materials.soft.interaction_range", "0 nm", "in [1e-24, 1e9] m"),
    "name of a material": ("materials.Soft", {}, "materials.Soft: 'Soft' is not a name"),
}


@pytest.mark.parametrize("case", BAD, ids=lambda case: case.replace(" ", "_"))
def test_mistakes_are_named(case, refused):
    refused(*BAD[case])
