"""List all files of a campaign, with the labels of their contents."""

from collections.abc import Iterable
from dataclasses import dataclass

from icha.configuration.campaign import Campaign
from icha.configuration.cases import run_sha256, surface_cases, surface_sha256, theories_sha256
from icha.contact.models import REFERENCE_MODEL
from icha.datasets import results
from icha.datasets.labels import RunLabels
from icha.datasets.stamp import Stamp, program_of_runs, program_of_surfaces, program_of_theories
from icha.support.checksums import CHECKSUMS


@dataclass(frozen=True)
class CampaignFiles:
    """Paths of all files of a campaign, in the order of the configuration.

    Attributes
    ----------
    surfaces : name and seed of each surface, by path.
    runs : labels of each run, by path.
    theories : surface of each file of theories, by path; theories are for nominally flat surfaces.
    compared : labels of each boundary-element run in a study with both models, by path.
    model_error : path of the file of model errors; empty if no study has both models.
    answers : path of the file of answers; empty if no study has boundary elements for several seeds.
    sensitivity : path of the file of sampled cases; empty if no study has `sample`.
    """

    surfaces: dict[str, tuple[str, int]]
    runs: dict[str, RunLabels]
    theories: dict[str, str]
    dataset: str
    table: str
    comparison: str
    compared: dict[str, RunLabels]
    model_error: list[str]
    answers: list[str]
    sensitivity: list[str]
    checks: str
    verdict: str
    checksums: str
    figures: list[str]
    report: str
    configuration: str
    deposit: str

    @property
    def computed(self) -> list[str]:
        """Paths of all results except the copy of the configuration, the checksums and the deposit."""
        return [*self.verified, self.verdict, *self.figures, self.report]

    @property
    def verified(self) -> list[str]:
        """Paths of all results that are in the list of checksums, except the verdict."""
        return [*self.surfaces, *self.runs, *self.theories, *self.analysed]

    @property
    def analysed(self) -> list[str]:
        """Paths of the files that the analysis of all runs writes."""
        further = (*self.model_error, *self.answers, *self.sensitivity)
        return [self.dataset, self.table, self.comparison, *further, self.checks]


# Surfaces, runs and theories that targets of the workflow need, named as the targets; other targets need all of them.
NEEDED = {"surfaces": ["surfaces"], "runs": ["surfaces", "runs"], "references": ["surfaces", "references"]}


def needed_files(files: CampaignFiles, targets: Iterable[str]) -> set[str]:
    """Return the paths of those surfaces, runs and theories that targets of the workflow may need."""
    parts = {"surfaces": files.surfaces, "runs": files.runs, "references": files.theories}
    return {path for target in targets or ["all"] for part in NEEDED.get(target, parts) for path in parts[part]}


def campaign_files(campaign: Campaign, folder: str = "") -> CampaignFiles:
    """Return the paths of all files of a campaign; each path begins with `folder`."""
    path = results.ResultFiles(campaign.name, folder).path

    def each(pattern, cases):
        return {path(pattern, case): case for case in cases}

    surfaces = surface_cases(campaign)
    runs = each(results.RUN, campaign.all_runs)
    compared = {
        file: case
        for file, case in runs.items()
        if case.model == REFERENCE_MODEL and campaign.compares_models(case.study)
    }
    return CampaignFiles(
        surfaces={path(results.SURFACE, surface=name, seed=seed): (name, seed) for name, seed in surfaces},
        runs=runs,
        theories={path(results.THEORIES, surface=name): name for name, _ in surfaces if campaign.is_flat(name)},
        dataset=path(results.DATASET),
        table=path(results.TABLE),
        comparison=path(results.COMPARISON),
        compared=compared,
        model_error=[path(results.MODEL_ERROR)] if compared else [],
        answers=[path(results.ANSWERS)] if _has_answers(campaign, runs.values()) else [],
        sensitivity=[path(results.SENSITIVITY)] if any(each.sample for each in campaign.studies.values()) else [],
        checks=path(results.CHECKS),
        verdict=path(results.VERDICT),
        checksums=path(CHECKSUMS),
        figures=[
            path(results.FIGURE, name=name, ending=ending)
            for name in campaign.figures.by_name()
            for ending in results.FIGURE_ENDINGS
        ],
        report=path(results.REPORT),
        configuration=path(results.CONFIGURATION),
        deposit=path(results.DEPOSIT, version=campaign.deposit_metadata().version or "without_version"),
    )


def expected_stamps(campaign: Campaign, folder: str = "") -> dict[str, Stamp]:
    """Return the stamps of all surfaces, runs and theories of a campaign, by path; each path begins with `folder`."""
    files, license = campaign_files(campaign), campaign.deposit_metadata().license
    first_seeds = dict(reversed(files.surfaces.values()))
    stamps = {
        path: (surface_sha256(campaign, name, seed), program_of_surfaces())
        for path, (name, seed) in files.surfaces.items()
    }
    stamps |= {path: (run_sha256(campaign, case), program_of_runs(case.model)) for path, case in files.runs.items()}
    stamps |= {
        path: (theories_sha256(campaign, name, first_seeds[name]), program_of_theories())
        for path, name in files.theories.items()
    }
    return {
        f"{folder}/{path}" if folder else path: {
            "id": f"{campaign.name}/{path.removesuffix('.nc')}",
            "license": license,
            "config_sha256": settings,
            "program_sha256": program,
        }
        for path, (settings, program) in stamps.items()
    }


def _has_answers(campaign, cases):
    """Return whether boundary elements have several seeds of the same contact, so that a study has answers."""
    seeds: dict[RunLabels, set[int]] = {}
    for case in cases:
        if case.model == REFERENCE_MODEL and campaign.studies[case.study].sample is None:
            seeds.setdefault(case._replace(seed=0), set()).add(case.seed)
    return any(len(each) > 1 for each in seeds.values())
