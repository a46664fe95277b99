"""Descriptions of the variables in all files: dimensions, units, long name and type of every variable."""
