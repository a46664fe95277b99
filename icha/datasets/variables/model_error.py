"""Variables of the error of the asperity model, without the dimensions that all variables have (labels, load)."""

from icha.datasets.variables.terms import Variable, bin_table, read_tables

ASKED = Variable(("reduced_pressure",), "1", "target of the reduced pressure, p/(E* h'rms)", coordinate=True)
_OF_SNAPSHOTS = ("gap_distribution_distance", "pressure_distribution_distance", "gap_density", "pressure_density")
_OF_SNAPSHOTS += ("jaccard", "shared_of_icha", "shared_of_boundary_elements")
_MISSING = {name: {"missing": "where a run has no snapshot"} for name in _OF_SNAPSHOTS}
MODEL_ERROR = read_tables("model_error.txt", attributes=_MISSING)[""]
BINS = bin_table("gap", "1", "rms height") | bin_table("pressure", "1", "contact modulus and rms slope")
