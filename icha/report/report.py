"""The report of a campaign: one HTML page that needs nothing else, neither network nor other files.

All of it follows from the campaign's data, so the same data give the same bytes. Times and memory are measurements
that differ from one execution to the next: they stand on a page of their own, which this one shows where it lies beside
it. Long tables show their first rows; what is left out is in the data, to which the page links.
"""

from __future__ import annotations

import base64
import importlib.metadata
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from icha.analysis.checks import worst
from icha.analysis.validity import of_dataset
from icha.checks.findings import Check
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import EXPLORER
from icha.figures.captions import count_runs
from icha.figures.registry import figure_number
from icha.report.sections import entry_section, provenance, sources, spectra, surface_row
from icha.report.studies import study_section
from icha.report.template import MOST_ROWS, template
from icha.support.atomic_files import whole_file

SOFTWARE = ("icha", "numpy", "scipy", "finufft", "xarray", "netCDF4", "matplotlib", "snakemake")

# Tables with more rows are folded up.
_FOLDED = 30


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report: its name, caption, the files that hold it, and the studies whose runs it shows."""

    name: str
    caption: str
    png: str | os.PathLike
    pdf: str | os.PathLike
    studies: tuple[str, ...] = ()


def write_report(
    path: str | os.PathLike,
    *,
    campaign: xr.DataTree,
    figures: Sequence[ReportFigure],
    checks: Iterable[Check],
    comparison: xr.DataTree | None = None,
    model_error: xr.DataTree | None = None,
    surfaces: Iterable[xr.Dataset] = (),
    times_path: str | os.PathLike | None = None,
    configuration: str = "",
    dataset_path: str | os.PathLike | None = None,
    files: Mapping[str, str | os.PathLike] = {},
    results: str | os.PathLike | None = None,
    citations: Sequence[str] = (),
    further_software: Sequence[str] = (),
) -> None:
    """Write the report.

    Parameters
    ----------
    path : the HTML file; links to other files are relative to its folder.
    campaign : the campaign dataset; its title, summary and licence head the page.
    figures : in order; those of one study stand with it, the others before all studies.
    checks : findings of `icha.analysis.checks.check_campaign`.
    comparison : `icha.analysis.common_loads.compare_campaign` of the campaign, if there is one.
    model_error : `icha.analysis.model_error.model_error` of the campaign, if it has boundary elements.
    surfaces : surface files, with or without their heights, for their statistics and power spectra.
    times_path : the page of what the jobs took (`write_times_page`), which is shown where it lies beside this one.
    configuration : text of the configuration as used.
    dataset_path : the campaign dataset's file, to be linked.
    files : further files to be linked, by what they are called.
    results : the folder of the campaign's results, to be linked; a page for exploring will be in it.
    citations : further sources to cite, such as those of measurements.
    further_software : packages that the campaign needs besides those that every campaign needs.
    """

    def link(target):
        return None if target is None else Path(os.path.relpath(target, Path(path).parent)).as_posix()

    pictures = _pictures(figures, campaign, link)
    studies = [study_section(campaign, name, comparison) for name in campaign.children]
    surfaces = list(surfaces)
    linked = {name: link(target) for name, target in files.items()}
    page = template("report.html").render(
        **_of_campaign(campaign, studies),
        **_of_checks(list(checks)),
        **_of_surfaces(surfaces),
        figures=pictures,
        graph=provenance(studies, surfaces, pictures, model_error, linked, link(dataset_path)),
        entries=[entry_section(node.to_dataset()) for node in _entries(model_error)],
        **_links(link, dataset_path, times_path, results),
        files=linked,
        configuration=configuration,
        citations=citations,
        references=_references(campaign, model_error),
        software={name: _version(name) for name in (*SOFTWARE, *further_software)},
    )
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _links(link, dataset, times, results):
    return {
        "dataset": link(dataset),
        "dataset_name": Path(dataset).name if dataset is not None else None,
        "times": link(times),
        "results": link(results),
        "explorer": link(Path(results, EXPLORER)) if results is not None else None,
    }


def _of_campaign(campaign, studies):
    """What the page says of the campaign as a whole."""
    totals = {name: sum(study[name] for study in studies) for name in ("asked", "complete", "failed", "missing")}
    return {
        "title": campaign.attrs.get("title", "Rough contact campaign"),
        "summary": campaign.attrs.get("summary", ""),
        "attributes": campaign.attrs,
        "studies": studies,
        "totals": totals | {"not_applicable": sum(len(study["not_applicable"]) for study in studies)},
        "validity": of_dataset(campaign),
        "most_rows": MOST_ROWS,
        "folded": _FOLDED,
        "paper": MODEL_PAPER.line,
    }


def _of_checks(checks):
    failed = [check for check in checks if not check.passed]
    return {"checks": worst(checks), "check_count": len(checks), "failed": failed}


def _of_surfaces(surfaces):
    rows = [surface_row(surface) for surface in surfaces[:MOST_ROWS]]
    return {
        "surfaces": rows,
        "surface_count": len(surfaces),
        "sources": sources(surfaces),
        "spectra": spectra(surfaces),
    }


def _pictures(figures, campaign, link):
    """What the page shows of the figures: those of one study with it, after those of none or of several.

    They have the numbers of their names, so that a figure has one number in the page, in its files and in the docs.
    Captions count the runs that are missing or drawn pale.
    """
    studies = list(campaign.children)
    places = [None, *studies]
    own = [each.studies[0] if len(each.studies) == 1 and each.studies[0] in studies else None for each in figures]
    ordered = sorted(zip(own, figures, strict=True), key=lambda pair: places.index(pair[0]))
    return [
        {
            "name": figure.name,
            "number": figure_number(figure.name),
            "caption": " ".join(filter(None, (figure.caption, count_runs(campaign, figure.studies)))),
            "data": base64.b64encode(Path(figure.png).read_bytes()).decode("ascii"),
            "pdf": link(figure.pdf),
            "study": study,
        }
        for study, figure in ordered
    ]


def _entries(model_error):
    return model_error.children.values() if model_error is not None else ()


def _references(campaign, model_error):
    """Sources that the studies' datasets and their boundary elements name, each once."""
    nodes = [*campaign.children.values(), *_entries(model_error)]
    found = (node.attrs.get("references", "") for node in nodes)
    return list(dict.fromkeys(part.strip() for text in found for part in text.split(";") if part.strip()))


def _version(name):
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
