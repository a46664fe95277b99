"""The report of a campaign: one HTML page that needs neither network nor other files.

The same data always give exactly the same file. The page shows only the first rows of long tables, and links to the
dataset, which contains all rows.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import xarray as xr

from icha.analysis.answers import answers_of, paragraph
from icha.analysis.checks import worst
from icha.analysis.sample_words import distribution_words, left_out_lines, sample_rows
from icha.analysis.validity import statements_on_dataset
from icha.checks.findings import Check
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import EXPLORER
from icha.figures.registry import figure_number
from icha.report.sections import list_sources, picture_of_spectra, summarise_errors, summarise_surface
from icha.report.studies import summarise_study
from icha.report.template import MOST_ROWS, write_page

SOFTWARE = ("icha", "numpy", "scipy", "finufft", "xarray", "netCDF4", "matplotlib", "snakemake")
FOLDED_ROWS = 30  # largest number of rows of a table that is not folded


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report.

    Attributes
    ----------
    name : name of the figure, such as `fig2_area_and_gap`.
    png : PNG file of the figure, which the page contains.
    pdf : PDF file of the figure, to which the page links.
    text : text file with the caption.
    studies : names of the studies whose runs the figure shows.
    """

    name: str
    png: str | os.PathLike
    pdf: str | os.PathLike
    text: str | os.PathLike
    studies: tuple[str, ...] = ()


def write_report(
    path: str | os.PathLike,
    *,
    campaign: xr.DataTree,
    figures: Sequence[ReportFigure],
    checks: Iterable[Check],
    model_error: xr.DataTree | None = None,
    answers: xr.DataTree | None = None,
    sensitivity: xr.DataTree | None = None,
    surfaces: Iterable[xr.Dataset] = (),
    configuration: str = "",
    dataset_path: str | os.PathLike | None = None,
    files: Mapping[str, str | os.PathLike] = {},
    results: str | os.PathLike | None = None,
    citations: Sequence[str] = (),
) -> None:
    """Write the report of a campaign as an HTML page.

    Parameters
    ----------
    path : HTML file to write; links to other files are relative to the folder of this file.
    campaign : campaign dataset, with title, summary and licence.
    figures : figures in their order. A figure of one study is in the section of this study; the others come first.
    checks : results of `icha.analysis.checks.check_campaign`.
    model_error : result of `icha.analysis.model_error.model_error`; None for a campaign without boundary elements.
    answers : result of `icha.analysis.estimates.estimate_campaign`; None without answers.
    sensitivity : result of `icha.analysis.sensitivity.sensitivity_of_campaign`; None without sampled parameters.
    surfaces : datasets of the surfaces, with or without heights, for statistics and power spectra.
    configuration : text of the configuration as used.
    dataset_path : file of the campaign dataset, to which the page links.
    files : further files to which the page links, by their titles.
    results : folder of the results of the campaign, for links to runs and surfaces.
    citations : further sources to cite, such as sources of measurements.
    """

    def link(target):
        """Return the path of a file relative to the folder of the page."""
        return None if target is None else Path(os.path.relpath(target, Path(path).parent)).as_posix()

    write_page(
        path,
        "report.html",
        **_content(campaign, list(checks), model_error, list(surfaces)),
        answers=[] if answers is None else [_answers(name, node) for name, node in answers.children.items()],
        samples=[] if sensitivity is None else list(map(_sample, sensitivity.children.values())),
        most_rows=MOST_ROWS,
        folded=FOLDED_ROWS,
        paper=MODEL_PAPER.line,
        figures=_pictures(figures, campaign, link),
        dataset=link(dataset_path),
        results=link(results),
        explorer=link(Path(results, EXPLORER)) if results is not None else None,
        files={name: link(target) for name, target in files.items()},
        configuration=configuration,
        citations=citations,
        software={name: version(name) for name in SOFTWARE},
    )


def _content(campaign, checks, model_error, surfaces):
    """Return the contents of the page on the campaign, its surfaces and its checks, by the names in the template."""
    studies = [summarise_study(campaign, name) for name in campaign.children]
    errors = list(model_error.children.values()) if model_error is not None else []
    texts = ";".join(node.attrs.get("references", "") for node in [*campaign.children.values(), *errors])
    counted = ("asked", "complete", "beyond_model", "failed", "missing")
    totals = {name: sum(study[name] for study in studies) for name in counted}
    return {
        "title": campaign.attrs.get("title", "Rough contact campaign"),
        "summary": campaign.attrs.get("summary", ""),
        "attributes": campaign.attrs,
        "studies": studies,
        "totals": totals | {"not_applicable": sum(len(study["not_applicable"]) for study in studies)},
        "validity": statements_on_dataset(campaign),
        "checks": worst(checks),
        "check_count": len(checks),
        "failed": [check for check in checks if not check.passed],
        "surfaces": [summarise_surface(surface) for surface in surfaces[:MOST_ROWS]],
        "surface_count": len(surfaces),
        "sources": list_sources(surfaces),
        "spectra": picture_of_spectra(surfaces),
        "entries": [summarise_errors(node.to_dataset()) for node in errors],
        "references": list(dict.fromkeys(source.strip() for source in texts.split(";") if source.strip())),
    }


def _answers(name, node):
    """Return the answers of a study for the page: name, paragraph and rows of a table."""
    rows = answers_of(node.to_dataset())
    return {"study": name, "paragraph": paragraph(name, rows).partition(": ")[2], "rows": rows}


def _sample(node):
    """Return the sampled cases of a study for the page: name, number of cases, parameters and rows of a table."""
    data = node.to_dataset()
    names = data["parameter"].values.tolist()
    return {
        "study": data.attrs["study"],
        "cases": data.sizes["case"],
        "parameters": [name.replace("_", " ") for name in names],
        "distributions": [distribution_words(data, name) for name in names],
        "rows": (rows := sample_rows(data)),
        "left_out": left_out_lines(rows),
    }


def _pictures(figures: Sequence[ReportFigure], campaign: xr.DataTree, link) -> list[dict]:
    """Return the figures of the page: first the figures of several studies or of no study, then those of each study.

    The number of a figure is part of its name.
    """
    studies = list(campaign.children)
    pictures = [
        {
            "name": figure.name,
            "number": figure_number(figure.name) or figure.name,
            "caption": Path(figure.text).read_text(encoding="utf-8").strip(),
            "data": base64.b64encode(Path(figure.png).read_bytes()).decode("ascii"),
            "pdf": link(figure.pdf),
            "study": figure.studies[0] if len(figure.studies) == 1 and figure.studies[0] in studies else None,
        }
        for figure in figures
    ]
    return sorted(pictures, key=lambda picture: [None, *studies].index(picture["study"]))
