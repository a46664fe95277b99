"""Variables that the campaign dataset has besides those of its runs, and what those depend on there."""

import numpy as np

from icha.datasets.build import bin_table
from icha.datasets.labels import LABELS
from icha.datasets.variables.terms import Variable

# Runs of the first kind alone are results. A run with failed checks has all of its values, which are not to be used.
COMPLETE, INCOMPLETE, MISSING, NOT_IN_DESIGN, FAILED_CHECKS = range(5)
STATUS_MEANINGS = ("complete", "incomplete", "missing", "not_in_design", "failed_checks")
# Status of runs that have a file, whatever it is worth.
COMPUTED_RUNS = (COMPLETE, INCOMPLETE, FAILED_CHECKS)

STATUS = Variable(
    LABELS,
    "1",
    "status of the run",
    np.int8,
    {
        "flag_values": np.arange(len(STATUS_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS_MEANINGS),
        "comment": "values that a run, or all runs of its model, do not have are filled with _FillValue",
    },
)
STEP_COUNT = Variable(
    LABELS,
    "1",
    "number of steps of the run",
    np.int32,
    {"comment": "from this position on along step, numbers are filled with _FillValue and texts are empty"},
)
FAILURE = Variable(
    LABELS, "1", "why the run is incomplete or which of its checks failed; empty where it is complete", str
)
APPLICABILITY = Variable(
    LABELS, "1", "why the model is not applicable to the surface and material of the run; empty where it is", str
)
CAMPAIGN = {
    "status": STATUS,
    "step_count": STEP_COUNT,
    "seed": Variable(("seed",), "1", "seed of the surface", np.int32, coordinate=True),
    "rms_slope": Variable(("rms_slope",), "1", "root mean square slope of the surface", coordinate=True),
    "model": Variable(("model",), "1", "model of contact: asperities or boundary_elements", str, coordinate=True),
    "surface": Variable(("surface",), "1", "name of the surface", str, coordinate=True),
    "material": Variable(("material",), "1", "name of the material", str, coordinate=True),
    "failure": FAILURE,
    "applicability": APPLICABILITY,
}

# Of these every run has as many as it has: in the campaign they stand one after the other.
RAGGED = ("spot", "event")


def place_of(dim: str, label: str) -> Variable:
    """Description of `<dim>_<label>`, which says of what is ragged to which run it belongs."""
    return Variable(
        (dim,), "1", f"position of the {dim}'s run along {label}, from 0", np.int32, {"instance_dimension": label}
    )


_TOPOGRAPHY = ("surface", "seed", "rms_slope")
# What a quantity of a run can depend on; everything else depends on all five labels. The snapshots' targets are those
# of the study's path, the bins are fixed in units of h_rms and of E* h'_rms.
VARIES_WITH = {
    **dict.fromkeys(("contact_modulus", "surface_energy", "interaction_range"), ("material",)),
    **dict.fromkeys(("rms_height", "rms_curvature", "nayak_parameter"), _TOPOGRAPHY),
    **dict.fromkeys(("spectral_moment_0", "spectral_moment_2", "spectral_moment_4"), _TOPOGRAPHY),
    **dict.fromkeys(("height_skewness", "height_kurtosis", "slope_anisotropy"), _TOPOGRAPHY),
    **dict.fromkeys(("period", "grid", "boundary"), ("surface",)),
    **dict.fromkeys(bin_table("gap", "m"), _TOPOGRAPHY),
    **dict.fromkeys(bin_table("pressure", "Pa"), ("rms_slope", "material")),
    **dict.fromkeys(("snapshot_kind", "snapshot_target", "control"), ()),
}
