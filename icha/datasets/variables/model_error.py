"""Variables of the error of the asperity model, without the dimensions that all have: labels of runs, and the load.

In the limit of a short range of attraction, contact has a sharp edge. There all areas of boundary elements (raw,
corrected, energetic) are the same.
"""

from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.variables.terms import Variable, bin_table, read_tables

# References with which the model is compared: the attribute `truth` of an entry.
SHORT_RANGE, FINITE_RANGE = MODELS[REFERENCE_MODEL].words, "boundary elements at finite range"

ASKED = Variable(("reduced_pressure",), "1", "target of the reduced pressure, p/(E* h'rms)", coordinate=True)
_OF_SNAPSHOTS = ("gap_distribution_distance", "pressure_distribution_distance", "gap_density", "pressure_density")
_OF_SNAPSHOTS += ("jaccard", "shared_of_icha", "shared_of_boundary_elements")
_MISSING = {name: {"missing": "where the runs keep no snapshot"} for name in _OF_SNAPSHOTS}
MODEL_ERROR = read_tables("model_error.txt", attributes=_MISSING)[""]
BINS = bin_table("gap", "1", "rms height") | bin_table("pressure", "1", "contact modulus and rms slope")
