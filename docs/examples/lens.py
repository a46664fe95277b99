"""A lens under given forces: contact radii are those of JKR."""

import numpy as np

import icha

radius, side, grid, modulus, energy = 5e-3, 800e-6, 96, 2e6, 0.04
lens = icha.Surface(np.zeros((grid, grid)), side, boundary="free", shape=icha.Sphere(radius))
forces = np.array([0.5e-3, 1e-3, 2e-3])
pdms = icha.Material(contact_modulus=modulus, surface_energy=energy)
run = icha.simulate(lens, pdms, icha.Path(forces=forces), model="boundary_elements")

# Johnson, Kendall and Roberts, Proc. R. Soc. A 324 (1971) 301-313, with E* = 3K/4.
adhesive = 3 * np.pi * energy * radius
theory = np.cbrt(3 * radius / (4 * modulus) * (forces + adhesive + np.sqrt(2 * adhesive * forces + adhesive**2)))
at_force = [int(np.abs(run.force.values - force).argmin()) for force in forces]
computed = run.contact_radius.values[at_force]
ratio = float((computed / theory)[-1])
for each in zip(forces, computed, theory, strict=True):
    print("{:.2g} N: contact radius {:.4g} m, theory {:.4g} m".format(*each))
