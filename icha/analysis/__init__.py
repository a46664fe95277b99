"""Analysis of finished runs: comparison at common loads, errors of the asperity model, checks of campaigns."""
