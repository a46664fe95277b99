"""Boundary elements: contact of the surface on its grid, with adhesion of a short or a finite range.

The model finds the position of the surface of the elastic body at each cell that makes the energy smallest: elastic
energy, energy of adhesion and work of the load, with no gap below zero. The energy has many local minima. Each step of
the solver lowers the energy, starting from the previous state of the path.

Read the modules in this order:

`elastic`       pressures under displacements, and displacements under pressures, by Fourier transforms.
`laws`          attraction between a cell and the body: tension and energy as functions of the gap.
`window`        the part of a free square that the solver needs.
`minimise`      the equilibrium at a given load, mean separation or rigid approach; its rates of change.
`full_contact`  contact without gaps: its pressure in closed form, and its opening.
`contact`       the contact model that a path follows; `patches` and `observables` evaluate its states.
"""
