"""Choose the seeds of each study with `accuracy`, from the results of its present levels.

The first levels are a pilot. From the pilot follow the scatter of each level and the time of its runs, and from these
the levels of least cost. The chosen seeds are in the file `levels.yaml` in the folder of results, which
`icha.configuration.load` reads. The configuration as used, and thus a deposit, contains them.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
import yaml

from icha.configuration.campaign import Campaign
from icha.configuration.studies import Accuracy, Study
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.files import read_campaign
from icha.datasets.labels import coarse_study
from icha.datasets.quantities import quantity
from icha.datasets.results import CHOSEN_LEVELS
from icha.path.targets import AREAS
from icha.planning.results import campaign_files
from icha.planning.run_costs import corrected_costs
from icha.support.atomic_files import whole_file
from icha.support.formatting import format_count
from icha.uncertainty.allocation import allocate, half_width_of_seeds, nest, variances_per_seed
from icha.uncertainty.control_variates import LEVELS, SEEDS
from icha.uncertainty.estimates import estimate_campaign

# If the accuracy exceeds the budget, it is increased by this factor until the budget suffices.
_WIDER = 1.05


class Choice(NamedTuple):
    """Accuracy of a study, and the seeds that reach the required accuracy.

    Attributes
    ----------
    quantity : quantity with the accuracy.
    half_width : largest half-width of the intervals of this quantity, relative to the estimate.
    required : largest half-width that the configuration allows.
    counts : number of seeds of each level that the study needs; empty if the present seeds suffice, or if more seeds
        do not help.
    seconds : expected time of all runs of the study with these seeds on one core.
    reason : reason why the accuracy cannot be reached; empty if it can.
    left_out : runs that the answers leave out, in words; empty if there are none.
    """

    quantity: str
    half_width: float
    required: float
    counts: dict[str, int]
    seconds: float
    reason: str = ""
    left_out: str = ""

    @property
    def sentence(self) -> str:
        """The accuracy that was reached, beside the required one, and the runs that are left out."""
        reached = f"± {100 * self.half_width:.2g} %" if math.isfinite(self.half_width) else "no interval"
        left_out = f"; {self.left_out}" if self.left_out else ""
        return f"{quantity(self.quantity).name} {reached} ({100 * self.required:.3g} % required){left_out}"


def choose_levels(campaign: Campaign, results: Path, cores: int) -> dict[str, Choice]:
    """Return the choice of each study with `accuracy`, by name; a budget is a time on `cores` cores."""
    studies = {name: study for name, study in campaign.studies.items() if study.accuracy is not None}
    if not studies:
        return {}
    tree = read_campaign(results / campaign_files(campaign).dataset)
    costs = _costs(campaign, results)
    # Without the asperity model, the other levels may take less time.
    estimates = [estimate_campaign(tree, asperities=used) for used in (True, False)]
    return {name: choose_for_study(name, study, estimates, costs[name], cores) for name, study in studies.items()}


def _costs(campaign, results) -> dict[str, dict[str, float]]:
    """Return the expected time of one seed of each level with all its contacts, s, for each study."""
    work: dict[tuple[str, str], list[float]] = {}
    seeds: dict[tuple[str, str], set[int]] = {}
    for case, cost in corrected_costs(campaign, results).items():
        work.setdefault((case.study, case.model), []).append(cost.work)
        seeds.setdefault((case.study, case.model), set()).add(case.seed)
    each = {key: sum(work[key]) / len(seeds[key]) for key in work}
    found: dict[str, dict[str, float]] = {}
    for name, study in campaign.studies.items():
        for model in study.models:
            found.setdefault(name, {})["asperities" if model == DEFAULT_MODEL else "fine"] = each[name, model]
            if (coarse_study(name), model) in each:
                found[name]["coarse"] = each[coarse_study(name), model]
    return found


def quantity_of(accuracy: Accuracy, study: Study) -> str:
    """Return the quantity whose accuracy a study requires: the contact area, unless another one is named or needed."""
    by_area = study.targets.last[0] in AREAS
    return accuracy.quantity or ("nominal_pressure" if by_area else "contact_area_fraction")


def choose_for_study(name: str, study: Study, estimates, costs: Mapping[str, float], cores: int) -> Choice:
    """Return the choice of one study; `estimates` are the answers with and without the asperity model."""
    accuracy = study.accuracy
    quantity, required = quantity_of(accuracy, study), accuracy.half_width
    answers = [_answers(estimate, name, quantity) for estimate in estimates]
    present = {level: len(getattr(study.seeds_of_levels, level) or ()) for level in SEEDS}
    if answers[0] is None or not answers[0]["fine_seeds"].all():
        reason = f"no run has a result for {quantity}; look at the runs that ended early"
        return Choice(quantity, math.inf, required, {}, 0.0, reason)
    found = answers[0]["left_out"].values.tolist() if "left_out" in answers[0] else []
    left_out = "; ".join(dict.fromkeys(filter(None, found)))
    if not _has_estimates(answers[0]):
        # Too few seeds have results. As many seeds are added as failed, and the accuracy is known afterwards.
        used = {level: int(answers[0][name].min()) for level, name in SEEDS.items()}
        counts = nest({level: 2 * count - used[level] for level, count in present.items() if count})
        return Choice(quantity, math.inf, required, counts, _seconds(costs, counts), "", left_out)
    half_width = half_width_of_seeds(answers[0])
    if not np.isfinite(answers[0]["estimate_high"]).all():
        reason = "no interval is stated for the runs that are left"
        return Choice(quantity, math.inf, required, {}, _seconds(costs, present), reason, left_out)
    if half_width <= required:
        return Choice(quantity, half_width, required, {}, _seconds(costs, present), "", left_out)
    budget = accuracy.budget and accuracy.budget * cores
    choices = [_least_cost(each, costs, required, budget, present) for each in answers if _has_estimates(each)]
    _, _, counts, reason = min(choices, key=lambda choice: choice[:2])
    if all(count == present[level] for level, count in counts.items()):
        counts = {}
    return Choice(quantity, half_width, required, counts, _seconds(costs, counts or present), reason, left_out)


def _has_estimates(answers: xr.Dataset | None) -> bool:
    return answers is not None and bool(np.isfinite(answers["estimate"]).all())


def _answers(estimate: xr.DataTree, name: str, quantity: str) -> xr.Dataset | None:
    if name not in estimate.children:
        return None
    study = estimate[name].to_dataset()
    study = study.isel(answer=(study["quantity"] == quantity).values)
    return study if study.sizes["answer"] else None


def _seconds(costs, counts) -> float:
    return sum(costs.get(level, 0.0) * count for level, count in counts.items())


def _least_cost(
    answers: xr.Dataset, costs, required: float, budget: float | None, present
) -> tuple[float, float, dict, str]:
    """Return expected half-width, time and numbers of seeds of least cost, and why the half-width is not `required`.

    `present` has the number of computed seeds of each level; all of them are used.
    """
    per_seed, grid = variances_per_seed(answers)

    def counts_for(half_width):
        counts = allocate(per_seed, grid, costs, half_width)
        return {level: max(count, present[level]) for level, count in counts.items()}

    try:
        counts = counts_for(required)
    except ValueError as error:
        return math.inf, math.inf, {}, str(error)
    half_width, reason = required, ""
    while budget is not None and _seconds(costs, counts) > budget:
        reason, half_width = "the budget does not suffice", _WIDER * half_width
        if half_width > 1:
            return math.inf, math.inf, {}, reason
        counts = counts_for(half_width)
    return half_width, _seconds(costs, counts), counts, reason


def words_of_levels(counts: Mapping[str, int]) -> str:
    """Return numbers of seeds in words, such as `8 seeds of the asperity model, 4 seeds of boundary elements`."""
    return ", ".join(f"{format_count(count, 'seed')} of {LEVELS[level]}" for level, count in counts.items())


def write_levels(results: Path, choices: Mapping[str, Choice]) -> None:
    """Write the chosen seeds of all studies to the folder of results; the seeds of other studies stay."""
    file = results / CHOSEN_LEVELS
    known = yaml.safe_load(file.read_text(encoding="utf-8")) if file.is_file() else {}
    known |= {
        name: {level: f"1..{count}" for level, count in choice.counts.items()}
        for name, choice in choices.items()
        if choice.counts
    }
    with whole_file(file) as temporary:
        temporary.write_text(yaml.safe_dump(known, sort_keys=False), encoding="utf-8")
