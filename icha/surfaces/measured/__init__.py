"""Measured topographies: read files of heights, and prepare surfaces for contact models."""
