"""What campaign cmc_truth says of its sweep by boundary elements: what that took, and where it stopped.

python read_truth.py RESULTS ANSWER

If the sweep was stopped on the way and went on, what it took is that of the last part.
"""

import json
import sys
from pathlib import Path

import numpy as np

from icha.datasets.files import read_dataset
from icha.datasets.results import job_file

RUN = "runs/challenge/challenge/seed1/slope1/boundary_elements/cmc.nc"

results = Path(sys.argv[1])
spent = json.loads((results / job_file(RUN, "benchmarks", ".jsonl")).read_text().splitlines()[-1])
run = read_dataset(results / RUN)
names = ("mean_separation", "reduced_pressure", "contact_area_fraction", "spot_count", "residual", "front_residual")
stops = run[list(names)].isel(step=np.flatnonzero(run["step_kind"] == "mean_separation"))
found = {
    "grid": int(run["grid"]),
    "wall": spent["s"],
    "processor": spent["cpu_time"],
    "peak": spent["max_rss"] * 2**20,
    "failure": run.attrs.get("incomplete", ""),
    "stops": [{name: float(stops[name][k]) for name in names} for k in range(stops.sizes["step"])],
}
Path(sys.argv[2]).write_text(json.dumps(found))
