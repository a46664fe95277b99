"""Descriptions of the variables in the file of a surface."""

from icha.datasets.variables.terms import TERMS, read_tables

_ATTRIBUTES = {
    "psd_wavevector": {"bounds": "psd_wavevector_bounds", "comment": "mean magnitude of the wave vectors in the ring"},
}
# Variables of every surface, of surfaces whose spectrum is known, of random surfaces, and of measured surfaces.
TABLES = list(read_tables("surface.txt", TERMS, _ATTRIBUTES).values())
SURFACE = {name: described for table in TABLES for name, described in table.items()}
