"""Uncertainty of results: means over seeds, estimates with intervals, errors of grids, sampled parameters."""
