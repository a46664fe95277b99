"""Solve some of the runs of a campaign again, side by side on all cores and without a workflow: seconds of each."""

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from icha.asperity.material import Material
from icha.configuration.cases import run_cases, run_settings
from icha.configuration.load import load_configuration
from icha.datasets.surface_file import read_surface
from icha.path.targets import Path as LoadingPath
from icha.simulation import simulate


def seconds(arguments):
    """Wall time of the contact solver for one run."""
    surface, settings = arguments
    scaled = read_surface(surface).scaled_to_rms_slope(settings["rms_slope"])
    start = time.perf_counter()
    simulate(scaled, Material(**settings["material"]), LoadingPath(**settings["path"]), seed=settings["seed"])
    return time.perf_counter() - start


if __name__ == "__main__":
    configuration, results, sample, answer, cores = sys.argv[1:]
    campaign = load_configuration(configuration).campaign
    cases = run_cases(campaign)
    chosen = cases[:: len(cases) // int(sample)]
    tasks = [(f"{results}/surfaces/{case.surface}/seed{case.seed}.nc", run_settings(campaign, case)) for case in chosen]
    with ProcessPoolExecutor(int(cores)) as pool:
        list(pool.map(seconds, tasks[: int(cores)]))  # what is only slow the first time
        each = list(pool.map(seconds, tasks))
    Path(answer).write_text(
        json.dumps({"runs": len(cases), "sample": len(each), "seconds_a_run": sum(each) / len(each)})
    )
