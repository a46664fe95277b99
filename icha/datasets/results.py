"""Paths of the files of a campaign below its folder of results, with fields in braces, and the storage of arrays."""

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
# Smaller arrays are not compressed: their chunks would need the space that compression saves (measured in
# docs/reference/dataset.md, "Compression").
LEAST_COMPRESSED = 1024
# Number of values of arrays that are compressed. Larger arrays are heights: compression would save a sixth of their
# space, and take 13 s at 8192 x 8192 nodes.
COMPRESSED_SIZES = range(LEAST_COMPRESSED, 2**22)
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True}
# Largest array of a campaign dataset that is read as a whole, in bytes.
LEFT_IN_FILE = 2**26


@dataclass(frozen=True)
class ResultFiles:
    """Paths of the results of a campaign, below its folder of results if one is given."""

    campaign: str
    folder: str = ""

    def path(self, pattern: str, case: NamedTuple | None = None, **names: object) -> str:
        """Return the path of one file: the pattern, filled with the campaign, the labels of a case, and `names`."""
        of_case = {} if case is None else labels.path_fields(case)
        return "/".join(filter(None, (self.folder, pattern.format(campaign=self.campaign, **of_case, **names))))


def job_file(path: str, kind: str, ending: str) -> str:
    """Return the path of the log or benchmark of the job that makes a file (or the files of a pattern).

    Parameters
    ----------
    path : the file, below the folder of results.
    kind, ending : `logs` and `.log`, or `benchmarks` and `.jsonl`.
    """
    folder, _, rest = path.partition("/")
    # Kinds of references have their own folders; the theories of the surfaces have none.
    job = rest if folder == "references" and "/" in rest else path
    return f"{kind}/{job.rpartition('.')[0]}{ending}"
