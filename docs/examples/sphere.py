"""A smooth sphere: the pull-off force is that of Johnson, Kendall and Roberts (1971)."""

import numpy as np

import icha

radius, side, grid = 1e-3, 300e-6, 64
sphere = icha.Surface(np.zeros((grid, grid)), side, boundary="free", shape=icha.Sphere(radius))
silicone = icha.Material(contact_modulus=2e6, surface_energy=0.05)
# Press 1.5 um beyond the first contact, then pull off.
path = icha.Path(indentations=[1.5e-6], unload=True)
run = icha.simulate(sphere, silicone, path, model="boundary_elements")

theory = 1.5 * np.pi * silicone.surface_energy * radius
ratio = float(run.pull_off_force) / theory
print(f"pull-off force {float(run.pull_off_force) * 1e6:.1f} uN, {ratio:.3f} times that of JKR")
