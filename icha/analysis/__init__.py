"""Analysis of finished runs: comparison at common loads, error of the asperity model, checks, validity."""
