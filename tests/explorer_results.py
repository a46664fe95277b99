"""A folder of results as a campaign leaves it, small, with what a page for exploring has to cope with."""

from functools import cache
from pathlib import Path

import compared_campaign as compared
import cyclic_campaign as cyclic
import small_campaign as small
import xarray as xr

from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import write_surface

LOOP = RunLabels("loops", "asperities", "rough", 1, 1.0, "soft")
FAILED = RunLabels("slopes", "asperities", "rough", 1, 0.2, "hertz")
NOTHING = RunLabels("slopes", "asperities", "rough", 1, 0.2, "soft")
REASON = 'the path ends early, at A/A0 < 1 & "for a reason" \u202e\x1b[2J'


@cache
def runs() -> dict[RunLabels, xr.Dataset]:
    """Runs: studies of slopes and seeds; one of both models; one there and back. One failed, one before any stop."""
    found = dict(small.runs()) | compared.runs() | dict(compared.patches()) | {LOOP: cyclic.run()}
    for labels, steps, snapshots in ((FAILED, 3, 1), (NOTHING, 0, 0)):
        run = found[labels]
        own = run["spot_snapshot"].values < snapshots
        first = run.isel(step=slice(0, steps), snapshot=slice(0, snapshots), spot=own)
        found[labels] = first.assign_attrs(incomplete=REASON)
    return found


def write_results(folder: Path) -> Path:
    """Write the campaign dataset, the topographies, and the runs by boundary elements."""
    attributes = {"title": "Small </script> campaign", "campaign": "small", "summary": "For tests."}
    (folder / "dataset").mkdir(parents=True)
    write_dataset(campaign_tree(runs().items(), attrs=attributes), folder / "dataset/small.nc")
    for seed in (1, 2, 3):
        file = folder / f"surfaces/rough/seed{seed}.nc"
        write_surface(file, small.surface(seed), name="rough", seed=seed, spectrum=small.SPECTRUM)
    for labels, run in runs().items():
        if labels.model == "boundary_elements":
            file = folder / f"runs/{labels.path}.nc"
            file.parent.mkdir(parents=True, exist_ok=True)
            run.to_netcdf(file)
    return folder
