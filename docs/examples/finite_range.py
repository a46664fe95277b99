"""A sphere with a long range of attraction, at a Tabor number of 0.3: its pull-off is between those of JKR and DMT."""

import numpy as np

import icha

radius, modulus, energy, tabor, grid = 1e-6, 1e9, 0.1, 0.3, 96
interaction_range = np.cbrt(radius * energy**2 / modulus**2) / tabor
side = 12 * np.cbrt(energy * radius**2 / modulus)
sphere = icha.Surface(np.zeros((grid, grid)), side, boundary="free", shape=icha.Sphere(radius))
material = icha.Material(modulus, energy, interaction_range)
indentation = 0.3 * np.cbrt(energy**2 * radius / modulus**2)
path = icha.Path(indentations=[indentation], unload=True)
run = icha.simulate(sphere, material, path, model="boundary_elements")

pull_off = float(run.pull_off_force) / (np.pi * energy * radius)
print(f"{run.attrs['attraction']}: pull-off force {pull_off:.3f} pi dgamma R; JKR 1.5, DMT 2")
