"""Variables that only the campaign dataset has, and the labels on which variables of the runs depend."""

import numpy as np

from icha.datasets.variables.run import ADHESION_MAP, LAYER
from icha.datasets.variables.terms import Variable, bin_table, read_tables

# Complete runs are results. The file of a run with failed checks contains values, but these values must not be used.
# Of a run that only failed checks of the hysteresis loss, the values of the loss must not be used.
COMPLETE, INCOMPLETE, MISSING, NOT_IN_DESIGN, FAILED_CHECKS, BEYOND_MODEL, FAILED_LOSS = range(7)
STATUS_MEANINGS = ("complete", "incomplete", "missing", "not_in_design", "failed_checks", "beyond_the_model")
STATUS_MEANINGS += ("failed_loss_checks",)
# Attribute of a run that gives the reason for the status.
STATUS_ATTRIBUTES = {INCOMPLETE: "incomplete", BEYOND_MODEL: "beyond_model", FAILED_CHECKS: "failed_checks"}
STATUS_ATTRIBUTES |= {FAILED_LOSS: "failed_loss_checks"}
# Status of runs that have a file.
COMPUTED_RUNS = (COMPLETE, INCOMPLETE, FAILED_CHECKS, BEYOND_MODEL, FAILED_LOSS)
# Status of runs whose whole path is a result, apart from the loss if it fails a check.
WHOLE_RUNS = (COMPLETE, FAILED_LOSS)
# Status of runs whose first loading is a result. If the path leaves the range of the model, the loading ends there.
LOADED_RUNS = (*WHOLE_RUNS, BEYOND_MODEL)
# Status of runs that are reported as failed.
FAILED_RUNS = (INCOMPLETE, FAILED_CHECKS, FAILED_LOSS)

_ATTRIBUTES = {
    "status": {
        "flag_values": np.arange(len(STATUS_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS_MEANINGS),
        "comment": "where a run, or every run of a model, lacks a variable, the value is _FillValue",
    },
    "step_count": {
        "comment": "at positions step_count and higher along step, numbers are _FillValue and texts are empty"
    },
}
CAMPAIGN = read_tables("campaign.txt", attributes=_ATTRIBUTES)[""]
STATUS = CAMPAIGN["status"]

# Dimensions whose length differs between runs. In the campaign dataset, the values of runs follow one after the other.
RAGGED = ("spot", "event")


def index_variable(dim: str, label: str) -> Variable:
    """Describe the variable `<dim>_<label>`: for each spot or event, the index of the run along `label`."""
    long_name = f"position of the {dim}'s run along {label}, from 0"
    return Variable((dim,), "1", long_name, np.int32, {"instance_dimension": label})


_TOPOGRAPHY = ("surface", "seed", "rms_slope")
# For each variable of the runs: the labels that change its value. Variables not listed here depend on all five labels.
# Runs of a study have the same snapshot targets. Bins are fixed in units of h_rms (gap) and of E* h'_rms (pressure).
VARIES_WITH = {
    **dict.fromkeys(
        ("contact_modulus", "surface_energy", "receding_energy", "interaction_range", "flaw_radius"), ("material",)
    ),
    **dict.fromkeys(("theoretical_strength", "interface_strength", *LAYER, *ADHESION_MAP), ("material",)),
    **dict.fromkeys(("rms_height", "rms_curvature", "unit_height", "unit_slope", "nayak_parameter"), _TOPOGRAPHY),
    **dict.fromkeys(("spectral_moment_0", "spectral_moment_2", "spectral_moment_4"), _TOPOGRAPHY),
    **dict.fromkeys(("height_skewness", "height_kurtosis", "slope_anisotropy"), _TOPOGRAPHY),
    **dict.fromkeys(("short_wavelength", "short_wavelength_estimated"), ("surface", "seed")),
    **dict.fromkeys(("period", "grid", "boundary", "shape", "shape_radius"), ("surface",)),
    **dict.fromkeys(bin_table("gap", "m"), _TOPOGRAPHY),
    **dict.fromkeys(bin_table("pressure", "Pa"), ("rms_slope", "material")),
    **dict.fromkeys(("snapshot_kind", "snapshot_target", "control"), ()),
}
# The same in a study with shapes or rms heights, where runs of equal rms slopes have different units of slopes.
VARIES_WITH_OWN_UNITS = VARIES_WITH | dict.fromkeys(bin_table("pressure", "Pa"), (*_TOPOGRAPHY, "material"))
