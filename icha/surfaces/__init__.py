"""Rough surfaces, random or measured: their spectra, moments and summits."""
