"""Variables of boundary-element solutions at a finite range, and of loops of loading and unloading."""

from icha.datasets.variables.terms import TERMS, read_tables

SOLUTION, LOOP = read_tables("boundary_elements.txt", TERMS).values()
