"""Configuration of a campaign of four small runs, with and without adhesion."""

CAMPAIGN = """
name: tiny
title: Tiny
summary: For tests.
license: CC0-1.0
surfaces:
  rough: {kind: self_affine, period: 100 um, rolloff_wavelength: 50 um, short_wavelength: 20 um, hurst: 0.8, grid: 32}
materials:
  bare: {contact_modulus: 25 MPa, surface_energy: 0 mJ/m^2, interaction_range: 2 nm}
  soft: {contact_modulus: 25 MPa, surface_energy: 50 mJ/m^2, interaction_range: 2 nm}
studies:
  load:
    surfaces: [rough]
    seeds: [1, 2]
    rms_slopes: [1.0]
    materials: [bare, soft]
    targets: {reduced_pressures: [1.0e-3, 1.0e-2]}
"""
