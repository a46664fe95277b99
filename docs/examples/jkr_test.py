"""A JKR test: contact modulus and work of adhesion from the points of a CSV file."""

import numpy as np

import icha

# Points of loading by Johnson, Kendall and Roberts (1971), with noise of 1 %, in place of a measured table.
radius, modulus, energy = 5e-3, 1.8e6, 0.03
force = np.linspace(0, 5e-3, 30)
adhesive = 3 * np.pi * energy * radius
contact = np.cbrt(3 * radius / (4 * modulus) * (force + adhesive + np.sqrt(2 * adhesive * force + adhesive**2)))
noise = 1 + 0.01 * np.random.default_rng(1).standard_normal((2, 30))
table = np.column_stack([force * noise[0] * 1e3, contact * noise[1] * 1e6])
np.savetxt("points.csv", table, delimiter=",", header="force (mN),contact radius (um)", comments="")

test = icha.fit_jkr_test("points.csv", radius)
print(test)
icha.plot_jkr_test(test).savefig("points_jkr.png")
ratio = test.contact_modulus.value / modulus
