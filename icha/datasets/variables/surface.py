"""Variables of the file of a surface."""

from icha.datasets.variables.terms import TERMS, read_tables

_ATTRIBUTES = {
    "psd_wavevector": {"bounds": "psd_wavevector_bounds", "comment": "mean over the ring's wave vectors"},
}
# Variables of every surface, of random ones, and of measured ones.
TABLES = list(read_tables("surface.txt", TERMS, _ATTRIBUTES).values())
SURFACE = TABLES[0] | TABLES[1] | TABLES[2]
