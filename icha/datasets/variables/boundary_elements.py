"""Variables of boundary-element solutions at a finite range: one state, and a loop."""

from icha.datasets.variables.terms import TERMS, read_tables

SOLUTION, LOOP = read_tables("boundary_elements.txt", TERMS).values()
