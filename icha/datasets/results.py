"""Path patterns of all files in the folder of results of a campaign, and limits for the storage of arrays."""

from __future__ import annotations

import re
from dataclasses import dataclass

from icha.datasets import labels

SURFACE = "surfaces/{surface}/seed{seed}.nc"
RUN = f"runs/{labels.RUN}.nc"
THEORIES = "references/{surface}.nc"
DATASET = "dataset/{campaign}.nc"
TABLE = "dataset/{campaign}.csv"
COMPARISON = "aggregated/{campaign}.nc"
MODEL_ERROR = "aggregated/model_error.nc"
ANSWERS = "aggregated/answers.nc"
SENSITIVITY = "aggregated/sensitivity.nc"
CHECKS = "checks.json"
VERDICT = "verdict.txt"
FIGURE = "figures/{name}.{ending}"
# A figure as a picture and as a drawing, its caption, and what it draws as a table.
FIGURE_ENDINGS = ("png", "pdf", "txt", "csv")
REPORT = "report.html"
EXPLORER = "explore.html"
CONFIGURATION = "config.used.yaml"
# Seeds that ICHA has chosen for the studies with `accuracy`.
CHOSEN_LEVELS = "levels.yaml"
DEPOSIT = "publish/{campaign}-{version}"
# Arrays with fewer values are not compressed, because the chunks of a compressed array would need as much space as
# compression saves (docs/reference/dataset.md, "Compression").
LEAST_COMPRESSED = 1024
# Heights of surfaces with this number of nodes or more are not compressed. Compression would save only a sixth of the
# space, and take 13 s for 8192 x 8192 nodes.
LEAST_PLAIN_HEIGHTS = 2**22
# A chunk of a compressed array has at most this number of values.
VALUES_IN_CHUNK = 2**18
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True}
# An array of a campaign dataset is read as a whole if its size in bytes is at most this number.
LEFT_IN_FILE = 2**26


def figure_number(name: str) -> int | None:
    """Return the number in the name of a figure; None for a figure of the user's own."""
    numbered = re.match(r"fig(\d+)_", name)
    return numbered and int(numbered[1])


@dataclass(frozen=True)
class ResultFiles:
    """Paths of the results of the campaign `campaign`; paths begin with `folder`, unless `folder` is empty."""

    campaign: str
    folder: str = ""

    def path(self, pattern: str, case: labels.RunLabels | None = None, **names: object) -> str:
        """Return the path of one file from a pattern; `case` and `names` give the values of names in braces."""
        of_case = {} if case is None else labels.path_fields(case)
        return "/".join(filter(None, (self.folder, pattern.format(campaign=self.campaign, **of_case, **names))))
