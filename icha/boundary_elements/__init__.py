"""Boundary elements in the limit of short-ranged adhesion: the grid resolves contact patches, not the adhesion range.

At a given mean separation the model minimises the elastic energy of the half-space minus the work of adhesion, with
gap >= 0. The contact is a set of grid cells. A closed cell has zero gap and carries pressure or tension. A cell at the
edge of contact carries a tension that falls linearly with its gap g, t = s (1 - g/g_c), and is open at g_c. The
fraction of contact of this cell is f = t/s = 1 - g/g_c. The tension t does the work of adhesion of the cell (`front`).
Open cells carry neither pressure nor tension. New contact forms at summits within reach of the attraction, and where
the surfaces would overlap.

The energy has many local minima. The model finds a minimum to which the energy falls from the previous state of the
path; if a front jumps, more than one minimum may be possible. Fronts advance or recede until the energy release rate
equals the work of adhesion along all edges.

Read the modules in this order:

`front`             law of a cell at the edge of contact: its tension, gap and fraction of contact.
`half_space`        displacements under pressures, by transforms of the grid; `tiles` and `transforms` for large grids.
`elastic_contact`   elastic contact of bonded cells, solved with an active set and conjugate gradients.
`front_solver`      equilibrium of the front at a given separation, by Newton steps that lower the energy.
`local_relaxation`  equilibrium of parts of the front in small windows, where only these parts are far from equilibrium.
`adhesive`          adhesive contact at a given separation: elastic contact, front, and new contact at summits.
`load_control`      the mean separation at which the contact has a given load or area.
`full_contact`      contact without gaps: its pressure in closed form, and its opening.
`contact`           the contact model that a path follows; `patches` and `observables` evaluate its states.
"""
