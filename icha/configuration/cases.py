"""List the runs and surfaces of a campaign: labels, settings of the jobs, and checksums."""

import hashlib
import json
from collections.abc import Callable
from functools import partial

from icha.configuration.campaign import Campaign
from icha.configuration.surfaces import MeasuredSurface
from icha.contact.models import DEFAULT_MODEL
from icha.datasets.labels import RunLabels


def surface_cases(campaign: Campaign) -> list[tuple[str, int]]:
    """Return surface and seed of each topography that a campaign uses, without repetition."""
    return list(dict.fromkeys((case.surface, case.seed) for case in campaign.all_runs))


def surface_settings(campaign: Campaign, name: str) -> dict:
    """Return the settings of a surface in SI units, without seed and path."""
    surface = campaign.surfaces[name]
    if isinstance(surface, MeasuredSurface):
        settings = {"kind": surface.kind} | surface.preparation
    elif not surface.from_file or surface.random:
        settings = surface.model_dump(exclude_none=True, exclude={"path", "boundary", "shape"})
    else:
        settings = {"kind": surface.kind, "period": surface.period, "metres_per_unit": surface.height_unit}
    # Defaults are left out, so that old settings keep their checksums.
    shape = {"shape": surface.shape.model_dump(exclude_none=True)} if surface.shape else {}
    return settings | ({"boundary": "free"} | shape if surface.free else {})


def run_settings(campaign: Campaign, case: RunLabels) -> dict:
    """Return the settings that determine the results of a run, in SI units."""
    return {
        "material": campaign.materials[case.material].model_dump(exclude_none=True),
        "path": campaign.studies[case.study].path_settings(),
        **_scale(campaign, case),
        "seed": case.seed,
    } | ({} if case.model == DEFAULT_MODEL else {"model": case.model})


def _scale(campaign: Campaign, case: RunLabels) -> dict[str, float]:
    """Return the rms slope of a run, and its rms height if the study prescribes rms heights, m.

    The heights of each realisation are scaled to the rms height. Its rms slope then differs from that of the label,
    which is the slope of the spectrum, unless all realisations have the same ratio of height and slope.
    """
    for height in campaign.studies[case.study].rms_heights or ():
        if campaign.slope_of_height(case.surface, height) == case.rms_slope:
            return {"rms_slope": case.rms_slope, "rms_height": height}
    return {"rms_slope": case.rms_slope}


def adhesive_contacts(campaign: Campaign, surface: str) -> list[dict]:
    """Return all pairs of rms slope and adhesive half-space in the runs on a surface, without repetition.

    Theories of rough contact do not hold on layers.
    """
    pairs = dict.fromkeys((case.rms_slope, case.material) for case in campaign.all_runs if case.surface == surface)
    return [
        {
            "rms_slope": rms_slope,
            "name": name,
            "material": campaign.materials[name].model_dump(exclude_none=True, exclude={"adhesion_map"}),
        }
        for rms_slope, name in pairs
        if campaign.materials[name].surface_energy > 0 and campaign.materials[name].thickness is None
    ]


def surface_sha256(campaign: Campaign, name: str, seed: int) -> str:
    """Compute the SHA-256 of all settings and files that determine a surface."""
    return _sha256([seed, *_surface_and_file(campaign, name)])


def run_sha256(campaign: Campaign, case: RunLabels) -> str:
    """Compute the SHA-256 of all settings and files that determine the results of a run."""
    settings = run_settings(campaign, case)
    settings["material"].get("adhesion_map", {}).pop("file", None)  # the settings contain the checksum of the file
    return _sha256([settings, *_surface_and_file(campaign, case.surface)])


def theories_sha256(campaign: Campaign, surface: str, seed: int) -> str:
    """Compute the SHA-256 of all settings and files that determine the theories of a surface."""
    return _sha256([seed, adhesive_contacts(campaign, surface), *_surface_and_file(campaign, surface)])


def _surface_and_file(campaign: Campaign, name: str) -> list:
    """Return the settings of a surface, and the checksum of its file if it has one."""
    topography = campaign.topographies.get(name)
    return [surface_settings(campaign, name), *([topography.sha256] if topography else [])]


def campaign_sha256(campaign: Campaign, of_run: Callable[[RunLabels], str] | None = None) -> str:
    """Compute the SHA-256 of all settings and files that determine the runs of a campaign; figures do not matter.

    `of_run` returns the checksum of a run; the default is `run_sha256`.
    """
    of_run = of_run or partial(run_sha256, campaign)
    return _sha256({case.path: of_run(case) for case in campaign.all_runs})


def _sha256(settings) -> str:
    """Compute the SHA-256 of settings; the order of the keys does not matter."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
