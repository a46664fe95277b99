"""A small campaign whose surfaces each have a slope of their own."""

from functools import cache

import compared_campaign as compared
import small_campaign as small

import icha
from icha.analysis.model_error import model_error
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


def errors():
    """The error of the model in the campaign."""
    return model_error(tree(), runs=[(labels, run) for labels, run in runs().items() if labels.model != "asperities"])


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
