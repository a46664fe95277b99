"""Rough surfaces: their spectra, moments and summits, made at random or measured."""
