"""Interacting asperities: the equilibrium of all contact spots at a given separation, load or area.

`interacting_asperities` contains the contact model. `solver` finds an equilibrium by alternating Newton steps and
events. `equations` contains the equations of equilibrium, `newton` the Newton steps, `jumps` the jumps into and out of
contact, and `unions` the coalescence of spots and the splitting of unions. `sites` and `iteration_state` define the
tables that these modules use. `distributions` computes the distributions of gap and pressure.
"""
