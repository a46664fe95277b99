"""Checks of one run, for all contact models."""
