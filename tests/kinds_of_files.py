"""Every kind of netCDF file that a campaign writes, small, made by the package itself."""

from pathlib import Path

import compared_campaign as compared
import numpy as np
import small_campaign as small

import icha
from icha.analysis.common_loads import compare_campaign
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.files import read_campaign, write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import write_surface
from icha.references.theories import reference_dataset
from icha.surfaces.moments import spectral_moments

HARD = icha.Material(contact_modulus=1e9, surface_energy=0.0, interaction_range=1e-8)
# The grid of the small surface resolves its range of attraction.
STICKY = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=0.6e-6)
ATTRIBUTES = {"campaign": "small", "license": "CC0-1.0", "config_sha256": "0" * 64}
PUBLISHED = {
    "title": "Small campaign",
    "summary": "For tests.",
    "creator_name": "Ada Example; Bo Example",
    "creator_type": "person; person",
    "product_version": "1.0.0",
}
LOOP = RunLabels("loops", "asperities", "rough", 1, 1.0, "soft")


def cycle():
    """A run in and back, with events."""
    path = icha.Path(reduced_pressures=[5e-4, 1e-3], unload=True, max_step=0.5)
    return icha.simulate(small.surface(), small.MATERIALS["soft"], path, seed=1)


def boundary_elements(material):
    """A run with boundary elements."""
    path = icha.Path(reduced_pressures=[1e-2])
    return icha.simulate(small.surface(), material, path, seed=1, model="boundary_elements")


def incomplete(run):
    """A run of which the first steps and the first snapshot are known."""
    own = np.flatnonzero(run["spot_snapshot"].values == 0)
    first = run.isel(step=slice(0, 3), snapshot=slice(0, 1), spot=own)
    return first.assign_attrs(incomplete="the path ends early")


def write_campaign_of(path: Path, looped) -> None:
    """A campaign of two studies: one of loading, with a run that failed and one that is missing, and one back again."""
    (failed, run), *others = small.runs()
    pairs = [(failed, incomplete(run)), *others[:-1], (LOOP, looped)]
    design = [*(labels for labels, _ in small.runs()), LOOP]
    write_dataset(campaign_tree(pairs, design=design, attrs=ATTRIBUTES | PUBLISHED), path)


def write_all(folder: Path) -> list[Path]:
    """Write a file of every kind to a folder; all of them."""
    surface, looped = small.surface(), cycle()
    datasets = {
        "run": small.run(),
        "run_without_snapshots": icha.simulate(surface, small.MATERIALS["hertz"], icha.Path(reduced_pressures=[1e-3])),
        "cycle": looped,
        "theories": reference_dataset(
            small.SPECTRUM, spectral_moments(surface), {(1.0, "soft"): small.MATERIALS["soft"]}
        ),
        "boundary_elements": boundary_elements(HARD),
        "boundary_elements_adhesive": boundary_elements(STICKY),
    }
    for name, data in datasets.items():
        write_dataset(data.assign_attrs(ATTRIBUTES), folder / f"{name}.nc")
    write_surface(folder / "surface.nc", surface, name="rough", seed=1, spectrum=small.SPECTRUM, attrs=ATTRIBUTES)
    write_campaign_of(folder / "campaign.nc", looped)
    write_dataset(compare_campaign(read_campaign(folder / "campaign.nc"), attrs=ATTRIBUTES), folder / "aggregated.nc")
    write_dataset(compared.errors(), folder / "model_error.nc")
    return sorted(folder.glob("*.nc"))
