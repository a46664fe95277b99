"""A small campaign whose surfaces each have a slope of their own, and the square that earlier versions made of it."""

from contextlib import contextmanager, nullcontext
from functools import cache

import compared_campaign as compared
import numpy as np
import small_campaign as small

import icha
from icha.analysis import model_error as comparison
from icha.datasets import campaign_file
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels

SLOPES = {"crop1": 0.5, "crop2": 0.21, "crop3": 0.34}
STUDY = "crops"


@cache
def runs():
    """Runs of three surfaces by both models."""
    pressures = compared.PRESSURES
    snapshots = [*(("reduced_pressure", p) for p in pressures), ("relative_load", 2e-3), ("area_fraction", 0.015)]
    path = icha.Path(reduced_pressures=pressures, snapshots=snapshots, max_step=0.2)
    found = {}
    for seed, (surface, slope) in enumerate(SLOPES.items(), 1):
        for name, material in small.MATERIALS.items():
            rough = small.surface(seed).scaled_to_rms_slope(slope)
            labels = RunLabels(STUDY, "asperities", surface, 1, slope, name)
            found[labels] = icha.simulate(rough, material, path, seed=1)
            found[labels._replace(model="boundary_elements")] = compared.own_patches(found[labels], area=1.25)
    return found


@cache
def tree():
    return campaign_tree(runs().items(), attrs={"title": "Crops", "summary": "For tests.", "license": "CC0-1.0"})


@contextmanager
def in_squares():
    """Arrange runs as earlier versions did: along all slopes of a study."""
    modules = (campaign_file, comparison)
    arrange = campaign_file.arrange_slopes
    for module in modules:
        module.arrange_slopes = lambda pairs: np.unique([slope for _, slope in pairs])
    try:
        yield
    finally:
        for module in modules:
            module.arrange_slopes = arrange


@cache
def square_tree():
    """The same in the form of earlier versions: a square of surfaces and slopes, of which the diagonal has runs."""
    with in_squares():
        return tree.__wrapped__()


def errors(campaign):
    """The error of the model in a campaign, `tree` or `square_tree`, in the same form."""
    patches = [(labels, run) for labels, run in runs().items() if labels.model == "boundary_elements"]
    with in_squares() if campaign is square_tree() else nullcontext():
        return comparison.model_error(campaign, runs=patches)


def many(surfaces):
    """Labels and runs of so many surfaces with a slope each: copies of one run, so that only their number matters."""
    run = next(iter(runs().values()))
    for k in range(surfaces):
        slope = 0.1 + 0.001 * k
        for material in ("soft", "hertz", "third"):
            yield (
                RunLabels(STUDY, "asperities", f"crop{k}", 1, slope, material),
                run.assign(rms_slope=run["rms_slope"] * 0 + slope),
            )
