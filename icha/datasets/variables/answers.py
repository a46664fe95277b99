"""Variables of the answers of a study: estimated means with their intervals."""

from icha.datasets.variables.terms import read_tables

_MISSING = {
    "share_grid": {"missing": "where the study has no runs on half the grid"},
    "share_inputs": {"missing": "where the study has no sampled parameters"},
}
ANSWERS = read_tables("answers.txt", attributes=_MISSING)[""]
