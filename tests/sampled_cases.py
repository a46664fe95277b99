"""Runs of sampled cases whose contact area is a known function of two parameters."""

import math

import compared_campaign as compared
import numpy as np

from icha.datasets.labels import RunLabels
from icha.uncertainty.distributions import Distribution

COUNT = 64
HURST, ENERGY = Distribution("uniform", 0.5, 0.9), Distribution("lognormal", 0.05, 1.3)


def template():
    return next(run for labels, run in compared.runs().items() if labels.material == "soft")


def sampled(study="one"):
    """Runs of 64 cases whose contact area is a known function of two parameters, and the parameters."""
    rng = np.random.default_rng(1)
    hurst, energy = HURST.quantile(rng.random(COUNT)), ENERGY.quantile(rng.random(COUNT))
    base, runs, cases = template(), [], []
    for k in range(COUNT):
        labels = RunLabels(study, "asperities", f"rough-case{k}", 1, 1.0, f"soft-case{k}")
        area = base["contact_area_fraction"] * math.exp(hurst[k]) * math.sqrt(energy[k] / 0.05)
        runs.append((labels, base.assign(contact_area_fraction=area)))
        cases.append((labels.surface, labels.rms_slope, labels.material))
    parameters = {"hurst": ("1", *HURST, hurst.tolist()), "surface_energy": ("J m^-2", *ENERGY, energy.tolist())}
    return runs, (cases, parameters)
