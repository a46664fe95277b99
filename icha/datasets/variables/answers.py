"""Variables of the answers of a study: estimated means with their intervals."""

from icha.datasets.variables.terms import read_tables

_NO_ESTIMATE = "where too few seeds have results"
# Variables without a value if no mean is estimated, besides the interval and the error of the grid.
WITHOUT_ESTIMATE = (
    "estimate",
    "share_seeds",
    "share_model",
    "share_refinement",
    "asperity_coefficient",
    "degrees_of_freedom",
)
_MISSING = {name: {"missing": _NO_ESTIMATE} for name in WITHOUT_ESTIMATE} | {
    "estimate_low": {"missing": "where more than a tenth of the runs is left out"},
    "estimate_high": {"missing": "where more than a tenth of the runs is left out"},
    "share_grid": {"missing": "where the study has no runs on half the grid"},
    "share_inputs": {"missing": "where the study has no sampled parameters"},
}
ANSWERS = read_tables("answers.txt", attributes=_MISSING)[""]
