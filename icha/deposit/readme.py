"""README.md of a deposit: what it is, what is in it, how far it can be trusted, and how to open and rerun it."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import jinja2
import numpy as np
import xarray as xr

from icha.analysis.checks import COMPLETED, worst
from icha.checks.findings import Check
from icha.configuration.campaign import Campaign
from icha.configuration.publication import Publication
from icha.configuration.surfaces import SelfAffineSurface
from icha.contact.models import MODEL_PAPER
from icha.datasets.campaign import run_place, runs_of_status
from icha.datasets.labels import LABELS, RunLabels, slopes_of
from icha.datasets.variables.campaign import COMPLETE, FAILED_CHECKS, INCOMPLETE, NOT_IN_DESIGN, STATUS_MEANINGS
from icha.deposit.attributes import acknowledgement
from icha.deposit.citation import paragraphs, web_address
from icha.deposit.deposit_files import COMPUTED
from icha.deposit.dictionary import Entry
from icha.deposit.licences import Licence
from icha.planning.costs import Cost
from icha.planning.needs import further_software
from icha.support import in_words

_TEMPLATE = "README.md.jinja"
# What lies in a deposit, in the order of interest: only what is there is listed.
_PARTS = {
    "dataset": "all runs in one file, a group per study",
    "aggregated": "the runs of every study compared at common loads, and with boundary elements where there are any",
    "runs": "the same runs, a file each",
    "surfaces": "the topographies, scaled to an rms slope of 1",
    "references": "theories, published points and boundary-element solutions for these topographies",
    "figures": "figures, as PNG and PDF",
    "report.html": "report: figures, tables and checks on a page that needs no network",
    "checks.json": "every check of every result, with its value and its limit",
    "verdict.txt": "the verdict on the checks",
    "config.used.yaml": "the configuration: everything that was asked for",
    "inputs": "the files that the configuration names",
    "source": "the program and the workflow that made all this, with the lock of their environment, `uv.lock`",
    "data_dictionary.csv": "every variable of every netCDF file: meaning, unit, dimensions, range",
}
# A longer list is cut.
_MOST_NAMES = 12
_METADATA = "citation, licence and provenance for people and machines"
# An address within a text, without what may follow it.
_ADDRESS = re.compile(r"(https?://[^\s<>|`\\]*[^\s<>|`\\.,;:!?()\[\]*_~'\"])")
# What Markdown takes for more than itself: anywhere, or as the beginning of an entity; and at the beginning of a line.
_SPECIAL = re.compile(r"[\\`*\[\]<>|~$#]|(?<![^\W_])_|_(?![^\W_])|&(?=[#\w])")
_SPECIAL_FIRST = re.compile(r"^(\d*)((?<!\d)[-+]|(?<=\d)[.)])(?!\w)")


class Part(NamedTuple):
    """What lies under a path of a deposit; `size` in bytes."""

    path: str
    content: str
    files: int
    size: int


class StudyDesign(NamedTuple):
    """The cells of a study, and what has become of them."""

    name: str
    models: tuple[str, ...]
    surfaces: tuple[str, ...]
    seeds: tuple[int, ...]
    rms_slopes: tuple[float, ...]
    materials: tuple[str, ...]
    status: Mapping[str, int]

    @property
    def runs(self) -> int:
        """Number of the runs that were asked for."""
        return sum(self.status.values()) - self.status[STATUS_MEANINGS[NOT_IN_DESIGN]]


class IncompleteRun(NamedTuple):
    """A run that did not reach the end of its path: the steps that it reached, why no more, and why it is published."""

    labels: RunLabels
    steps: int
    failure: str
    reason: str


class ModelError(NamedTuple):
    """Errors of the model against boundary elements, smallest and largest over loads, surfaces and slopes."""

    entry: str
    study: str
    material: str
    loads: tuple[float, float]
    area: tuple[float, float]
    separation: tuple[float, float]
    overlap: tuple[float, float]


def readme(
    publication: Publication,
    *,
    campaign: Campaign,
    licence: Licence,
    revision: str,
    dataset: xr.DataTree,
    checks: Sequence[Check],
    model_error: xr.DataTree | None,
    dictionary: Sequence[Entry],
    sizes: Mapping[str, int],
    cost: Cost,
) -> str:
    """The page, in Markdown.

    Parameters
    ----------
    publication : what the deposit says of itself, with version, date, authors, title, summary and licence.
    campaign, dataset, checks, model_error : what was asked for, and what came of it.
    licence : that of the data.
    revision : that of the source.
    dictionary : the variables of all files.
    sizes : bytes of every file, by its path in the deposit.
    cost : what computing the whole campaign is expected to take.
    """
    text = _template().render(
        publication=publication,
        citation=citation(publication),
        paper=MODEL_PAPER,
        summary=paragraphs(publication.summary),
        licence=licence,
        revision=revision,
        variables=_short_dictionary(dictionary, campaign.name),
        cost=cost,
        addresses={each.identifier: web_address(each.identifier) for each in publication.related_identifiers},
        **_asked(campaign),
        **_outcome(publication, dataset, checks, model_error),
        **_content(sizes),
    )
    return text.rstrip() + "\n"


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {
        "text": markdown,
        "acknowledgement": acknowledgement,
        "link": _link,
        "number": "{:.4g}".format,
        "value": "{:z.2g}".format,
        "size": in_words.size,
        "duration": in_words.duration,
        "span": _span,
        "seeds": _seeds,
        "few": _few,
    }
    return environment.get_template(_TEMPLATE)


def _asked(campaign: Campaign) -> dict:
    """The campaign as its author wrote it."""
    surfaces = _written(campaign, "surfaces")
    return {
        "campaign": campaign,
        "surfaces": surfaces,
        "materials": _written(campaign, "materials"),
        "self_affine": any(isinstance(each, SelfAffineSurface) for each in surfaces.values()),
        "sides": _known_of(surfaces, campaign.period, "{:.4g}".format),
        "grids": _known_of(surfaces, campaign.grid, str),
        "adhesive": any(material.surface_energy > 0 for material in campaign.materials.values()),
        "both_ways": any(study.unload or study.turning_points for study in campaign.studies.values()),
        "installed": (*further_software(campaign), "environment")[0],
        "free": any(campaign.is_free(name) for name in campaign.surfaces),
    }


def _outcome(publication: Publication, dataset: xr.DataTree, checks: Sequence[Check], model_error) -> dict:
    """Runs that are complete and that are not, and how far both can be trusted."""
    designs = study_designs(dataset)
    complete = _runs_of_status(dataset, COMPLETE)
    incomplete = [*_runs_of_status(dataset, INCOMPLETE), *_runs_of_status(dataset, FAILED_CHECKS)]
    known = {failure.run: failure.reason for failure in publication.known_failures}
    example = (complete or incomplete)[0][0]
    study = dataset[example.study].to_dataset()
    incomplete = [IncompleteRun(*run, known.get(str(run[0]), "")) for run in incomplete]
    return {
        "designs": designs,
        "partial": [study.name for study in designs if study.status[STATUS_MEANINGS[NOT_IN_DESIGN]]],
        "incomplete": incomplete,
        "example": example,
        # Where surfaces have slopes of their own, these have no index by which to select.
        "slope_place": run_place(study, example)["rms_slope"] if study["rms_slope"].ndim == 2 else None,
        "checks": [_meant(check) for check in worst(checks)],
        "failed": [check for check in checks if not check.passed and check.name != COMPLETED],
        "known": known,
        "count": _count_by_name(checks),
        "passed": sum(check.passed for check in checks),
        "total": len(checks),
        "errors": model_errors(model_error) if model_error is not None else [],
    }


def _content(sizes: Mapping[str, int]) -> dict:
    """The files and their bytes."""
    return {
        "parts": _parts(sizes),
        "files": len(sizes),
        "size": sum(sizes.values()),
        "computed": sum(size for path, size in sizes.items() if path.split("/")[0] in COMPUTED),
    }


def citation(publication: Publication) -> str:
    """How to cite a deposit, in a line, but for its DOI."""
    authors = "; ".join(author.sorted_name for author in publication.authors)
    return f"{authors} ({publication.date[:4]}): {publication.title}. Version {publication.version}. Data set."


def study_designs(dataset: xr.DataTree) -> list[StudyDesign]:
    """The design of every study in a campaign dataset."""
    found = []
    for name, study in dataset.children.items():
        status = study["status"].values
        found.append(
            StudyDesign(
                name,
                *(
                    tuple(slopes_of(study) if label == "rms_slope" else study[label].values.tolist())
                    for label in LABELS
                ),
                {meaning: int(np.count_nonzero(status == k)) for k, meaning in enumerate(STATUS_MEANINGS)},
            )
        )
    return found


def model_errors(tree: xr.DataTree) -> list[ModelError]:
    """The errors of the model for every entry of boundary elements and every material."""
    found = []
    for entry, node in tree.children.items():
        data = node.to_dataset()
        for material in data["material"].values.tolist():
            own = data.sel(material=material)
            there = np.isfinite(own["area_error_mean"])
            if not bool(there.any()):
                continue
            loads = own["reduced_pressure"].broadcast_like(there).where(there)
            ranges = [
                (float(values.min()), float(values.max()))
                for values in (
                    loads,
                    *(own[name] for name in ("area_error_mean", "separation_error_mean", "jaccard_mean")),
                )
            ]
            found.append(ModelError(entry, str(data.attrs["study"]), material, *ranges))
    return found


def _runs_of_status(dataset: xr.DataTree, asked: int) -> list[tuple[RunLabels, int, str]]:
    """The runs of a status in a campaign dataset: number of steps, and the reason why they failed, if they did."""
    found = []
    for name, node in dataset.children.items():
        study = node.to_dataset()
        for labels in runs_of_status(study, name, (asked,)):
            place = run_place(study, labels)
            steps, failure = (study[each].isel(place) for each in ("step_count", "failure"))
            found.append((labels, int(steps), str(failure.values)))
    return found


def _meant(check: Check) -> Check:
    """The check with words for what it is in general: where a run failed, it has those of that run."""
    return (
        replace(check, description="0 if the run reached the end of its path, else 1")
        if check.name == COMPLETED
        else check
    )


def _count_by_name(checks: Iterable[Check]) -> dict[str, int]:
    found: dict[str, int] = {}
    for check in checks:
        found[check.name] = found.get(check.name, 0) + 1
    return found


def _short_dictionary(dictionary: Sequence[Entry], campaign: str) -> list[Entry]:
    """The variables of the campaign dataset along the path, and those that tell runs apart, each once."""
    found = {}
    for entry in dictionary:
        axes = entry.dimensions.split()
        if entry.file == f"dataset/{campaign}.nc" and "spot" not in axes and "event" not in axes:
            found.setdefault(entry.variable, entry)
    return list(found.values())


def _parts(sizes: Mapping[str, int]) -> list[Part]:
    found = []
    for part, content in _PARTS.items():
        own = [size for path, size in sizes.items() if path == part or path.startswith(f"{part}/")]
        if own:
            folder = part not in sizes
            found.append(Part(f"{part}/" if folder else part, content, len(own), sum(own)))
    rest = {path: size for path, size in sizes.items() if path.split("/")[0] not in _PARTS}
    found.append(Part(", ".join(sorted(rest)), _METADATA, len(rest), sum(rest.values())))
    return found


def _written(campaign: Campaign, section: str) -> dict:
    """The entries of a section that its author wrote, without the variants that studies made of them."""
    entries = getattr(campaign, section)
    return {name: each for name, each in entries.items() if campaign.origin(section, name) == name}


def _known_of(surfaces: Iterable[str], ask, form) -> dict[str, str]:
    """What a campaign knows of its surfaces; nothing of files that nobody has read."""
    found = {}
    for name in surfaces:
        try:
            found[name] = form(ask(name))
        except AttributeError:
            found[name] = ""
    return found


def _few(values: Sequence) -> str:
    """A list, or its beginning and its length."""
    shown = [markdown(value) for value in values]
    return ", ".join(shown) if len(shown) <= _MOST_NAMES else f"{', '.join(shown[:_MOST_NAMES])}, … ({len(shown)})"


def markdown(text) -> str:
    """Plain text in a line of Markdown that shows nothing else, in a table, too; addresses are links."""
    line = " ".join(str(text).split())
    # Of the parts, every other is an address.
    parts = [
        _link(part) if number % 2 else _SPECIAL.sub(r"\\\g<0>", part)
        for number, part in enumerate(_ADDRESS.split(line))
    ]
    return _SPECIAL_FIRST.sub(r"\1\\\2", "".join(parts))


def _link(address: str) -> str:
    """A web address as a link."""
    plain = re.sub(r"[\s<>|`\\]", lambda found: quote(found[0]), address)
    return f"<{plain}>"


def _span(values, form="{:z.3g}") -> str:
    """Smallest and largest value, or the only one."""
    least, most = form.format(min(values)), form.format(max(values))
    return least if least == most else f"{least} to {most}"


def _seeds(values: Sequence[int]) -> str:
    """Seeds as people write them: `1..50`, or a list."""
    values = sorted(values)
    if len(values) > 2 and values == list(range(values[0], values[-1] + 1)):
        return f"{values[0]}..{values[-1]}"
    return ", ".join(map(str, values))
