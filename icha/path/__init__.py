"""Paths of a contact: loading to given loads, areas or separations, and unloading.

`targets` defines a path, and `follow` follows a path with any contact model. `loading` computes the first loading,
`cycle` computes paths with unloading or turning points, and `step_accuracy` decides whether the steps of a cycle are
short enough. `stops` finds the equilibrium at a target between two states. `energy_balance` computes the work, the
stored energy and the losses of every step. `snapshots` defines the snapshots in a configuration.
"""
