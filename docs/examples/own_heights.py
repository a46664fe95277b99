"""Own heights, here a wave along x: the contact area is that of Westergaard (1939)."""

import numpy as np

import icha

period, grid, amplitude, modulus = 100e-6, 128, 0.5e-6, 10e6
x = np.arange(grid) / grid
heights = np.tile(amplitude * np.cos(2 * np.pi * x), (grid, 1))
surface = icha.Surface(heights, period)

complete = np.pi * modulus * amplitude / period  # pressure of complete contact
path = icha.Path(pressures=[complete / 4, complete / 2])
run = icha.simulate(surface, icha.Material(modulus, 0.0), path, model="boundary_elements")

area = float(run.contact_area_fraction[-1])
theory = 2 / np.pi * np.arcsin(np.sqrt(0.5))
ratio = area / theory
print(f"at half the pressure of complete contact, A/A0 = {area:.3f}; theory {theory:.3f}")
