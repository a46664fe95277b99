"""Measured topographies: reading what instruments and people write, and preparing it for the model."""
