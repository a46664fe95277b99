"""How accurately equilibria are found: what the solvers keep to, and what the checks of their results may ask for."""

from icha.contact.models import ASPERITIES, BOUNDARY_ELEMENTS

# Largest error of an equilibrium of asperities, in units of h_rms.
RESIDUAL_TOLERANCE = 1e-9
# Relative error of the stiffness of a contact, by the model.
STIFFNESS_TOLERANCE = {ASPERITIES: 1e-6, BOUNDARY_ELEMENTS: 1e-4}
# Of what a load is made up of, the part below which it counts as none when its error is measured.
SMALLEST_LOAD = 1e-4
# Without adhesion the area of boundary elements changes by whole cells: one that is held is met to so many, and to this
# part of it.
HELD_CELLS, HELD_PART = 2.0, 0.1
