"""Contact area and mean separation against load for three materials: figure 2 of the paper in a loop."""

import matplotlib.pyplot as plt

import icha

spectrum = icha.SelfAffineSpectrum(100e-6, 20e-6, 5e-6, hurst=0.8, rms_slope=1.0)
surface = spectrum.realise(grid=128, seed=1)
path = icha.Path(reduced_pressures=[1e-3, 2e-3, 5e-3, 1e-2, 2e-2])

runs = {}
axes = separations = None
for surface_energy in (0.0, 0.05, 0.1):
    material = icha.Material(contact_modulus=25e6, surface_energy=surface_energy, interaction_range=2.071e-9)
    run = runs[surface_energy] = icha.simulate(surface, material, path)
    label = f"{surface_energy * 1e3:g} mJ/m$^2$"
    axes = icha.plot_area(run, axes, label=label)
    separations = icha.plot_separation(run, separations, label=label)
axes.legend()
separations.legend()
plt.show()

# Theory for small loads: sqrt(8/pi) = 1.60 by Persson, sqrt(2 pi) = 2.51 by Bush, Gibson and Thomas.
last = runs[0.0].isel(step=-1)
ratio = float(last.contact_area_fraction / last.reduced_pressure)
print(f"without adhesion, A/A0 = {ratio:.2f} p*")
