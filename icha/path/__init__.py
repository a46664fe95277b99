"""Paths of a contact: loading to given loads, areas or separations, and unloading.

`targets` defines a path, and `follow` follows it with any contact model: `loading` up to the last target, `cycle`
through unloading and turning points, in steps that `step_accuracy` judges. `stops` finds the equilibrium that meets a
target between two states, and `energy_balance` accounts for the work, the stored energy and the losses of every step.
"""
