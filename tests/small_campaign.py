"""Campaign so small that every test process simulates it."""

from functools import cache

import icha
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels

SPECTRUM = icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=100e-6 / 7, hurst=0.8)
PRESSURES = [1e-3, 3e-3, 1e-2, 3e-2]
MATERIALS = {"soft": icha.Material(25e6, 0.05, 2.071e-9), "hertz": icha.Material(25e6, 0.0, 2.071e-9)}


@cache
def surface(seed=1):
    return SPECTRUM.realise(grid=32, seed=seed)


@cache
def run(seed=1, rms_slope=1.0, material="soft"):
    # The relative load lies at another place of the path for every slope.
    path = icha.Path(
        reduced_pressures=PRESSURES, snapshots=[("relative_load", 2e-3), ("area_fraction", 0.015)], max_step=0.2
    )
    return icha.simulate(surface(seed).scaled_to_rms_slope(rms_slope), MATERIALS[material], path, seed=seed)


@cache
def runs():
    labels = [
        RunLabels("slopes", "asperities", "rough", 1, slope, name) for slope in (1.0, 0.2) for name in ("soft", "hertz")
    ]
    labels += [RunLabels("single", "asperities", "rough", seed, 1.0, "soft") for seed in (2, 1)]
    return tuple((each, run(each.seed, each.rms_slope, each.material)) for each in labels)


@cache
def tree():
    return campaign_tree(
        runs(), attrs={"title": "Small campaign", "summary": "For tests.", "campaign": "small", "license": "CC0-1.0"}
    )
