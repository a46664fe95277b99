"""Interacting asperities: equilibrium of all contact spots at a given separation, load or area, and its observables.

`interacting_asperities` is the contact model that a path follows. `solver` searches for an equilibrium: it alternates
Newton steps (`newton`) for the equations of the present spots (`equations`) with jumps into and out of contact
(`jumps`) and the coalescence and splitting of spots (`unions`). `sites` and `iteration_state` hold the tables that pass
between them, and `distributions` evaluates gap and pressure in an equilibrium.
"""
