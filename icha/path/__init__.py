"""Paths of a contact: loading to given loads, areas or separations, and unloading."""
