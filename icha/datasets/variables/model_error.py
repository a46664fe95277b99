"""Variables of the error of the model, without the labels of runs and the load along which all lie.

In the limit of a short range contact has an edge beyond which nothing acts: all areas of boundary elements are one.
"""

from icha.contact.models import MODELS, REFERENCE_MODEL
from icha.datasets.build import bin_table
from icha.datasets.variables.terms import Variable

# What the model is compared with: the attribute `truth` of an entry.
SHORT_RANGE, FINITE_RANGE = MODELS[REFERENCE_MODEL].words, "boundary elements at finite range"

ASKED = Variable(("reduced_pressure",), "1", "reduced pressure asked for, p/(E* h'rms)", coordinate=True)
_UNKEPT = {"missing": "where the runs keep no snapshot"}
MODEL_ERROR = {
    "contact_area_fraction": Variable((), "1", "real over nominal contact area, A/A0, of the model"),
    "contact_area_fraction_boundary_elements": Variable(
        (),
        "1",
        "real over nominal contact area, A/A0, of boundary elements; at finite ranges corrected by the contact's "
        "perimeter",
    ),
    "contact_area_fraction_raw": Variable((), "1", "fraction of the boundary elements' nodes in contact"),
    "perimeter_correction": Variable(
        (), "1", "fraction of the nodes in contact over the area corrected by the contact's perimeter, minus 1"
    ),
    "energetic_area_fraction": Variable(
        (), "1", "energy of adhesion of boundary elements over that of full contact; the raw area without adhesion"
    ),
    "reduced_separation": Variable((), "1", "mean separation over rms height, of the model"),
    "reduced_separation_boundary_elements": Variable((), "1", "mean separation over rms height, of boundary elements"),
    "area_error": Variable((), "1", "contact area of the model over that of boundary elements, minus 1"),
    "energetic_area_error": Variable(
        (),
        "1",
        "contact area of the model over the energetic area of boundary elements, minus 1; area_error without adhesion",
    ),
    "separation_error": Variable((), "1", "mean separation of the model over that of boundary elements, minus 1"),
    "gap_distribution_distance": Variable(
        (),
        "1",
        "first Wasserstein distance between the distributions of the gap over the nominal area, in units of the rms "
        "height; contact, and what overlaps in the model, has gap 0",
        further=_UNKEPT,
    ),
    "pressure_distribution_distance": Variable(
        (),
        "1",
        "first Wasserstein distance between the distributions of the contact pressure over the nominal area, in units "
        "of the nominal pressure",
        further=_UNKEPT,
    ),
    "jaccard": Variable((), "1", "area in contact in both over area in contact in at least one", further=_UNKEPT),
    "shared_of_icha": Variable((), "1", "area in contact in both over area in contact in the model", further=_UNKEPT),
    "shared_of_boundary_elements": Variable(
        (), "1", "area in contact in both over area in contact in boundary elements", further=_UNKEPT
    ),
    "load_error": Variable((), "1", "nominal pressure of boundary elements over the one asked for, minus 1"),
    "residual": Variable(
        (),
        "1",
        "error of the boundary elements' solver: its criterion of convergence; in the limit of short range, the "
        "largest deviation from 1 of sqrt(energy release rate over surface energy)",
    ),
    "solution_grid": Variable((), "1", "boundary elements along a side", int),
    "gap_density": Variable(
        ("gap_bin",), "1", "P(u) h_rms of boundary elements, over the nominal area", further=_UNKEPT
    ),
    "pressure_density": Variable(
        ("pressure_bin",), "1", "P(p) E* h'rms of boundary elements in contact, over the nominal area", further=_UNKEPT
    ),
}
BINS = bin_table("gap", "1", "rms height") | bin_table("pressure", "1", "contact modulus and rms slope")
