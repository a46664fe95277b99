"""The report of a campaign: one HTML page that needs neither network nor other files.

The same data always give exactly the same file. Times and memory differ from one execution to the next, so they are on
another page, which this one embeds. Long tables contain their first rows only; all rows are in the data, to which the
page links.
"""

from __future__ import annotations

import base64
import importlib.metadata
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import xarray as xr

from icha.analysis.checks import worst
from icha.analysis.validity import statements_on_dataset
from icha.checks.findings import Check
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import EXPLORER
from icha.figures.captions import count_runs
from icha.figures.registry import figure_number
from icha.report.sections import build_provenance, draw_spectra, list_sources, summarise_errors, summarise_surface
from icha.report.studies import summarise_study
from icha.report.template import MOST_ROWS, write_page

SOFTWARE = ("icha", "numpy", "scipy", "finufft", "xarray", "netCDF4", "matplotlib", "snakemake")
FOLDED_ROWS = 30  # longer tables are folded


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report.

    Attributes
    ----------
    name, caption : its name and caption.
    png, pdf : its files.
    studies : studies whose runs it shows.
    """

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
    campaign : the campaign dataset, with title, summary and licence.
    figures : in order; figures of one study are in its section, the others precede all studies.
    checks : results of `icha.analysis.checks.check_campaign`.
    comparison : `icha.analysis.common_loads.compare_campaign` of the campaign, if available.
    model_error : `icha.analysis.model_error.model_error` of the campaign, if it has boundary elements.
    surfaces : surface files, with or without their heights, for statistics and power spectra.
    times_path : the page of times (`write_times_page`), which is embedded.
    configuration : text of the configuration as used.
    dataset_path : file of the campaign dataset, for a link.
    files : further files to link, by their titles.
    results : folder of the campaign's results, for links.
    citations : further sources to cite, such as those of measurements.
    further_software : packages that this campaign needs besides `SOFTWARE`.
    """
    link = partial(_link, Path(path).parent)
    pictures = _pictures(figures, campaign, link)
    studies = [summarise_study(campaign, name, comparison) for name in campaign.children]
    surfaces = list(surfaces)
    linked = {name: link(target) for name, target in files.items()}
    write_page(
        path,
        "report.html",
        **_campaign_values(campaign, studies),
        **_check_values(list(checks)),
        **_surface_values(surfaces),
        figures=pictures,
        graph=build_provenance(studies, surfaces, pictures, model_error, linked, link(dataset_path)),
        **_source_values(campaign, model_error),
        dataset=link(dataset_path),
        times=link(times_path),
        results=link(results),
        explorer=link(Path(results, EXPLORER)) if results is not None else None,
        files=linked,
        configuration=configuration,
        citations=citations,
        software={name: _version(name) for name in (*SOFTWARE, *further_software)},
    )


def _link(folder: Path, target: str | os.PathLike | None) -> str | None:
    """Return the path of a file relative to the folder of the page."""
    return None if target is None else Path(os.path.relpath(target, folder)).as_posix()


def _campaign_values(campaign: xr.DataTree, studies: list[dict]) -> dict:
    """Return what the page prints about the campaign as a whole."""
    counted = ("asked", "complete", "beyond_model", "failed", "missing")
    totals = {name: sum(study[name] for study in studies) for name in counted}
    return {
        "title": campaign.attrs.get("title", "Rough contact campaign"),
        "summary": campaign.attrs.get("summary", ""),
        "attributes": campaign.attrs,
        "studies": studies,
        "totals": totals | {"not_applicable": sum(len(study["not_applicable"]) for study in studies)},
        "validity": statements_on_dataset(campaign),
        "most_rows": MOST_ROWS,
        "folded": FOLDED_ROWS,
        "paper": MODEL_PAPER.line,
    }


def _check_values(checks: list[Check]) -> dict:
    failed = [check for check in checks if not check.passed]
    return {"checks": worst(checks), "check_count": len(checks), "failed": failed}


def _surface_values(surfaces: list[xr.Dataset]) -> dict:
    return {
        "surfaces": [summarise_surface(surface) for surface in surfaces[:MOST_ROWS]],
        "surface_count": len(surfaces),
        "sources": list_sources(surfaces),
        "spectra": draw_spectra(surfaces),
    }


def _pictures(figures: Sequence[ReportFigure], campaign: xr.DataTree, link) -> list[dict]:
    """Return what the page shows of the figures: first those of no study or of several, then those of each study.

    A figure has the number of its name, on the page as in the documentation. Captions count missing and pale runs.
    """
    studies = list(campaign.children)
    pictures = [
        {
            "name": figure.name,
            "number": figure_number(figure.name),
            "caption": " ".join(filter(None, (figure.caption, count_runs(campaign, figure.studies)))),
            "data": base64.b64encode(Path(figure.png).read_bytes()).decode("ascii"),
            "pdf": link(figure.pdf),
            "study": figure.studies[0] if len(figure.studies) == 1 and figure.studies[0] in studies else None,
        }
        for figure in figures
    ]
    return sorted(pictures, key=lambda picture: [None, *studies].index(picture["study"]))


def _source_values(campaign: xr.DataTree, model_error: xr.DataTree | None) -> dict:
    """Return the error of the model, and the sources that its datasets and those of the campaign name."""
    entries = list(model_error.children.values()) if model_error is not None else []
    texts = ";".join(node.attrs.get("references", "") for node in [*campaign.children.values(), *entries])
    return {
        "entries": [summarise_errors(node.to_dataset()) for node in entries],
        "references": list(dict.fromkeys(source.strip() for source in texts.split(";") if source.strip())),
    }


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
