"""The mean over random surfaces, with an interval that contains it in 90 % of cases."""

import numpy as np
from scipy.stats import t

import icha

spectrum = icha.SelfAffineSpectrum(100e-6, 25e-6, 12.5e-6, hurst=0.8, rms_slope=0.2)
rubber = icha.Material(contact_modulus=2e6, surface_energy=0.0)
path = icha.Path(reduced_pressures=[2e-2])

areas = []
for seed in range(1, 9):
    run = icha.simulate(spectrum.realise(grid=96, seed=seed), rubber, path)
    areas.append(float(run.contact_area_fraction[-1]))
mean, error = np.mean(areas), np.std(areas, ddof=1) / np.sqrt(len(areas))
half_width = t.ppf(0.95, len(areas) - 1) * error
print(f"A/A0 = {mean:.4f} +- {half_width:.4f} over {len(areas)} surfaces")
