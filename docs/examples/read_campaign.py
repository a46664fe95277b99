"""The dataset of a campaign: means over the seeds of a study, one line for each material.

python read_campaign.py results/NAME/dataset/NAME.nc STUDY
"""

import sys

from icha.datasets.campaign import loading_stops
from icha.datasets.files import read_campaign

file, name = sys.argv[1:]
study = read_campaign(file)[name].to_dataset()
study = study.isel(model=0, surface=0, rms_slope=0)
# Steps at which the path stopped at a target, on loading.
area = study.contact_area_fraction.where(loading_stops(study)).mean("seed")
pressure = study.nominal_pressure.where(loading_stops(study)).mean("seed")

rows = []
for material in study.material.values:
    at = {"material": material}
    for p, a in zip(pressure.sel(at).values, area.sel(at).values, strict=True):
        if a == a:  # not NaN
            rows.append((str(material), float(p), float(a)))
            print(f"{material}: {p:.4g} Pa, A/A0 = {a:.4g}")
