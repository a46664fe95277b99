"""A scan in a text file: `read_scan` takes the same keys as a surface of `kind: measured` in a campaign."""

import numpy as np

import icha

# A file as an instrument writes it: heights in nm, row by row.
true = icha.SelfAffineSpectrum(64e-6, 32e-6, 8e-6, hurst=0.8, rms_slope=0.05).realise(grid=96, seed=3)
np.savetxt("scan.txt", true.heights * 1e9, fmt="%.4f", delimiter="\t")

scan = icha.read_scan("scan.txt", size="64 um", height_unit="nm", boundary="periodic", detrend="none")
run = icha.simulate(scan, icha.Material(2e6, 0.0), icha.Path(pressures=[1e3, 3e3]), model="boundary_elements")
print(run[["nominal_pressure", "contact_area_fraction", "mean_gap"]].to_dataframe())

ratio = scan.rms_height / np.std(true.heights)
print(f"rms height {scan.rms_height * 1e9:.1f} nm, {ratio:.6f} times that of the numbers in the file")
