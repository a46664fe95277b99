"""Paths of the files of a campaign below its folder of results, in braces what differs; how their arrays are stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from icha.datasets import labels

SURFACE = "surfaces/{surface}/seed{seed}.nc"
RUN = f"runs/{labels.RUN}.nc"
THEORIES = "references/{surface}.nc"
SOLUTION = f"references/boundary_elements/{labels.SOLUTION}.nc"
LOOP = f"references/loops/{labels.CONTACT}.nc"
DATASET = "dataset/{campaign}.nc"
COMPARISON = "aggregated/{campaign}.nc"
MODEL_ERROR = "aggregated/model_error.nc"
CHECKS = "checks.json"
VERDICT = "verdict.txt"
FIGURE = "figures/{name}.{ending}"
REPORT = "report.html"
EXPLORER = "explore.html"
RUN_TIMES = "run_times.tsv"
CONFIGURATION = "config.used.yaml"
DEPOSIT = "publish/{campaign}-{version}"
# As measured (docs/reference/dataset.md, "How files are kept"): smaller arrays lose by being cut into chunks what
# compression gains.
LEAST_COMPRESSED = 1024
# Larger arrays are heights: a fifth less space would take 13 s for 8192 nodes a side.
COMPRESSED_SIZES = range(LEAST_COMPRESSED, 2**22)
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True}
# Bytes of an array of a campaign dataset beyond which it is not read as a whole.
LEFT_IN_FILE = 2**26


@dataclass(frozen=True)
class ResultFiles:
    """Paths of the results of a campaign, with its folder of results before them, if one is given."""

    campaign: str
    folder: str = ""

    def path(self, pattern: str, case: NamedTuple | None = None, **names: object) -> str:
        """Path of one file: what stands in the braces is the campaign's, of the labels of a case, or given by name."""
        of_case = {} if case is None else labels.path_fields(case)
        return "/".join(filter(None, (self.folder, pattern.format(campaign=self.campaign, **of_case, **names))))


def job_file(path: str, kind: str, ending: str) -> str:
    """Path of what is kept of the job of a file (or of the files of a pattern).

    Parameters
    ----------
    path : the file, below the folder of results.
    kind, ending : what is kept: `logs` and `.log`, or `benchmarks` and `.jsonl`.
    """
    folder, _, rest = path.partition("/")
    # Kinds of references have their own folders; the theories of the surfaces have none.
    job = rest if folder == "references" and "/" in rest else path
    return f"{kind}/{job.rpartition('.')[0]}{ending}"
