"""Expected costs of runs, corrected by the measured times of finished batches."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from icha.configuration.campaign import Campaign
from icha.datasets.labels import RunLabels
from icha.planning import costs
from icha.planning.batches import run_batches
from icha.planning.results import campaign_files


def correct_costs(
    campaign: Campaign, cost_of: Mapping[RunLabels, costs.Cost], results: Path
) -> dict[RunLabels, costs.Cost]:
    """Correct the expected cost of each run by the measured times of its study and model in the folder `results`."""
    runs = campaign_files(campaign).runs
    pairs: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for batch in run_batches(campaign, runs):
        case = runs[batch.files[0]]
        # A line of the log for each computed file (workflow/scripts/job.py).
        expected = {
            f": {campaign.name}/{path.removesuffix('.nc')}\n": cost_of[runs[path]].seconds for path in batch.files
        }
        pairs.setdefault((case.study, case.model), []).extend(_measured_time(results, batch.name, expected))
    factors = {key: costs.correction(each) for key, each in pairs.items()}
    return {
        case: replace(cost, seconds=cost.seconds * factors[case.study, case.model]) for case, cost in cost_of.items()
    }


def _measured_time(results: Path, batch: str, expected: Mapping[str, float]) -> Iterator[tuple[float, float]]:
    """Yield expected and measured time of the last job of a batch.

    `expected` is the expected time of each file, s, by the text of the file in the log. Kept files are not in the log.
    """
    try:
        seconds = float(json.loads((results / "benchmarks/runs" / f"{batch}.jsonl").read_bytes())["s"])
        log = (results / "logs/runs" / f"{batch}.log").read_text(encoding="utf-8", errors="replace")
    except (OSError, ValueError, KeyError, TypeError):
        return
    computed = [each for text, each in expected.items() if text in log]
    if computed and seconds > 0:
        yield costs.JOB + sum(computed), seconds
