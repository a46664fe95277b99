"""A small configuration that tests change: its text, and sections to put into it."""

from pathlib import Path

REPOSITORY = Path(__file__).parents[1]

GOOD = """
name: demo
title: A title
summary: A summary
license: CC-BY-4.0
surfaces:
  rough:
    kind: self_affine
    period: 100 um
    rolloff_wavelength: 20 um
    short_wavelength: 10 um
    hurst: 0.8
    grid: 80
materials:
  soft:
    contact_modulus: 25 MPa
    surface_energy: 50 mJ/m^2
    interaction_range: 2.071 nm
studies:
  one:
    surfaces: [rough]
    seeds: [1, 2]
    rms_slopes: [0.2, 1.0]
    materials: [soft]
    targets:
      reduced_pressures: [1e-3, 0.01]
    snapshots:
      - area_fraction: 0.02
"""

ORCID = "0000-0002-1825-0097"
CARBERRY = {"family_names": "Carberry", "given_names": "Josiah"}


def measured_surface(**changes):
    """A section of a measured surface."""
    scan = REPOSITORY / "config/topographies/synthetic_scan.txt"
    section = {"kind": "measured", "path": str(scan), "height_unit": "nm", "size": ["72 um", "64 um"]}
    return section | {"missing": "fill", "boundary": "window"} | changes


def file_surface(path):
    """A section of a surface from a file."""
    return {"kind": "file", "path": str(path), "height_unit": "um", "period": "1 mm"}
