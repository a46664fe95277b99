"""Variables of the error of the asperity model. The dimensions that all variables have (labels, load) are not listed.

In the limit of a short range of attraction, contact has a sharp edge. Therefore the raw, the corrected and the
energetic area of boundary elements are equal in this limit.
"""

from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.variables.terms import Variable, bin_table, read_tables

# Values of the attribute `truth` of an entry: the reference with which the asperity model is compared.
SHORT_RANGE, FINITE_RANGE = MODELS[REFERENCE_MODEL].words, "boundary elements at finite range"

ASKED = Variable(("reduced_pressure",), "1", "target of the reduced pressure, p/(E* h'rms)", coordinate=True)
_OF_SNAPSHOTS = ("gap_distribution_distance", "pressure_distribution_distance", "gap_density", "pressure_density")
_OF_SNAPSHOTS += ("jaccard", "shared_of_icha", "shared_of_boundary_elements")
_MISSING = {name: {"missing": "where a run has no snapshot"} for name in _OF_SNAPSHOTS}
MODEL_ERROR = read_tables("model_error.txt", attributes=_MISSING)[""]
BINS = bin_table("gap", "1", "rms height") | bin_table("pressure", "1", "contact modulus and rms slope")
