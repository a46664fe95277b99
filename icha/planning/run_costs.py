"""Expected cost of the runs of a campaign, corrected by the times of finished runs."""

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.configuration.cases import run_settings
from icha.configuration.plausibility import energy_ratio
from icha.datasets.labels import RunLabels
from icha.path.targets import QUANTITIES
from icha.planning import costs
from icha.planning.results import campaign_files
from icha.planning.validity import surface_facts

# Assumed reduced pressure of a target that is given as a mean separation.
_UNKNOWN_LOAD = 0.03


# Line in the log of a batch for each computed file (workflow/scripts/job.py).
_COMPUTED = re.compile(r"^[\w-]+/(runs/\S+): computed in (\S+) s$", re.MULTILINE)


def run_costs(campaign: Campaign) -> dict[RunLabels, costs.Cost]:
    """Return the expected cost of each run; runs that differ only in the seed have the same cost."""
    facts = cache(lambda surface: surface_facts(campaign, surface))

    @cache
    def cost(case):
        # Few summits of an indenter come into contact, and its contact stays small, however sticky its roughness is.
        flat, grid, free = campaign.is_flat(case.surface), campaign.grid(case.surface), campaign.is_free(case.surface)
        summits = facts(case.surface)["summits"] if flat else 1
        sweep = _cost_parameters(run_settings(campaign, case), campaign.period(case.surface))
        ratio = energy_ratio(campaign, case) if sweep["adhesive"] and flat else math.inf
        return costs.run_cost(case.model, grid, summits, energy_ratio=ratio, free=free, **sweep)

    return {case: cost(case._replace(seed=0)) for case in campaign.all_runs}


def corrected_costs(campaign: Campaign, results: Path) -> dict[RunLabels, costs.Cost]:
    """Return the cost of each run, corrected by the times of the finished runs of its study and model in `results`."""
    cost_of, runs = run_costs(campaign), campaign_files(campaign).runs
    pairs: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for log in (results / "logs/runs").glob("*.log"):
        for path, seconds in _COMPUTED.findall(log.read_text(encoding="utf-8", errors="replace")):
            if case := runs.get(f"{path}.nc"):
                pairs.setdefault((case.study, case.model), []).append((cost_of[case].seconds, float(seconds)))
    factors = {key: costs.correction(each) for key, each in pairs.items()}
    return {
        case: replace(cost, seconds=cost.seconds * factors.get((case.study, case.model), 1.0))
        for case, cost in cost_of.items()
    }


def _cost_parameters(settings, side) -> dict:
    """Convert the settings of a run to arguments of `run_cost`; `side` is the side of the surface, m."""
    path, snapshots = settings["path"], settings["path"]["snapshots"]
    modulus, slope = settings["material"]["contact_modulus"], settings["rms_slope"]
    # Reduced pressure of a target; about half of an area fraction, and `_UNKNOWN_LOAD` if the pressure is unknown.
    loads = {
        "reduced_pressure": lambda value: value,
        "relative_load": lambda value: value / (slope or 1.0),
        "pressure": lambda value: value / (modulus * (slope or 1.0)),
        "force": lambda value: value / (modulus * side**2 * (slope or 1.0)),
        "area_fraction": lambda value: value / 2,
        "contact_radius": lambda value: math.pi * value**2 / side**2 / 2,
    }
    stops = {(kind, value) for kind, each in QUANTITIES.items() for value in path.get(each.plural) or ()}
    stops |= {tuple(snapshot) for snapshot in snapshots or ()}
    return {
        # Targets in tension have few spots.
        "load": max(0.0, *(loads[kind](value) if kind in loads else _UNKNOWN_LOAD for kind, value in stops)),
        "stops": len(stops),
        "snapshots": 1 if snapshots is None else len(snapshots),
        "adhesive": settings["material"]["surface_energy"] > 0,
        "legs": len(path.get("turning_points", ())) + bool(path.get("unload")),
        "max_step": path["max_step"],
    }
