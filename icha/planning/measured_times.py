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
        expected = {path: cost_of[runs[path]].seconds for path in batch.files}
        pairs.setdefault((case.study, case.model), []).extend(_measured_time(results, batch.name, expected))
    factors = {key: costs.correction(each) for key, each in pairs.items()}
    return {
        case: replace(cost, seconds=cost.seconds * factors[case.study, case.model]) for case, cost in cost_of.items()
    }


def _measured_time(results: Path, batch: str, expected: Mapping[str, float]) -> Iterator[tuple[float, float]]:
    """Yield expected and measured time of the last job of a batch; `expected` has the expected time of each file, s."""
    try:
        file = results / "benchmarks/runs" / f"{batch}.jsonl"
        seconds = float(json.loads(file.read_bytes())["s"])
        # Files that the job has kept are older.
        begin = file.stat().st_mtime - seconds - 1.0
        computed = [path for path in expected if (results / path).stat().st_mtime >= begin]
    except (OSError, ValueError, KeyError, TypeError):
        return
    if computed and seconds > 0:
        yield costs.JOB + sum(expected[path] for path in computed), seconds
