"""Variables of the file of a surface."""

from icha.datasets.variables.terms import TERMS, read_tables

_ATTRIBUTES = {
    "psd_wavevector": {"bounds": "psd_wavevector_bounds", "comment": "mean over the ring's wave vectors"},
}
SURFACE = read_tables("surface.txt", TERMS, _ATTRIBUTES)[""]
