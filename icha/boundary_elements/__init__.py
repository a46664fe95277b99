"""Boundary elements in the limit of a short range of adhesion: it resolves contact patches, not the range of adhesion.

The model minimises, at a given mean separation, the elastic energy of the half-space less the work of adhesion, under
gap >= 0. Contact is a set of grid cells. A closed cell has gap 0 and bears pressure or tension. A cell at the edge of
contact carries a tension that falls linearly with its gap g, t = s (1 - g/g_c), and is open at g_c; its fraction of
contact is f = t/s = 1 - g/g_c. The work of t is the work of adhesion of the cell (`front`). Elsewhere there is neither
pressure nor attraction: new contact forms at summits within reach of the attraction, or where surfaces would overlap.

There are many minima. The model takes the one that the path reaches from its last state with falling energy: fronts
advance, recede and run until the energy release rate is the work of adhesion along all edges.

Read the modules in this order:

`front`             the law of a cell at the edge of contact.
`half_space`        displacement under pressures, on the full grid; `tiles` and `transforms` make it fast on large ones.
`elastic_contact`   the elastic contact of bonded cells: an active set, solved by conjugate gradients.
`front_solver`      the front at a given separation: Newton steps, each of which lowers the energy.
`local_relaxation`  the same in small windows, where few places of a large contact are far from equilibrium.
`adhesive`          elastic contact and front together, with new contact at summits.
`load_control`      the separation at which a contact has a given load or area.
`full_contact`      contact without gaps: a closed form, and where it opens.
`contact`           all of this as a contact model; `patches` and `observables` for its results.
"""
