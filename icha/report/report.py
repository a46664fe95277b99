"""The report of a campaign: one HTML page that needs neither network nor other files.

The same data always give exactly the same file. Tables of results are in the files to which the page links.
"""

from __future__ import annotations

import base64
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import xarray as xr

from icha.checks.findings import Check
from icha.contact.models import MODEL_PAPER
from icha.datasets.results import figure_number
from icha.report import tables
from icha.report.answers import answers_of, answers_table, distribution_words, samples_table, sentences
from icha.report.spectra import picture_of_spectra
from icha.report.template import write_page
from icha.report.validity import statements_on_results
from icha.support.formatting import format_count
from icha.uncertainty.sensitivity import left_out_of_samples

SOFTWARE = ("icha", "numpy", "scipy", "finufft", "xarray", "netCDF4", "matplotlib", "snakemake")
FOLDED_ROWS, MOST_ROWS = 30, 300  # largest number of rows of a table that is not folded, and that is not cut


def write_report(
    path: str | os.PathLike,
    *,
    campaign: xr.DataTree,
    figures: Iterable[str | os.PathLike],
    checks: Iterable[Check],
    model_error: xr.DataTree | None = None,
    answers: xr.DataTree | None = None,
    sensitivity: xr.DataTree | None = None,
    surfaces: Iterable[xr.Dataset] = (),
    configuration: str = "",
    files: Mapping[str, str | os.PathLike] = {},
    results: str | os.PathLike | None = None,
    citations: Sequence[str] = (),
) -> None:
    """Write the report of a campaign as an HTML page.

    Parameters
    ----------
    path : HTML file to write; links to other files are relative to the folder of this file.
    campaign : campaign dataset, with title, summary and licence.
    figures : all files of all figures, in the order of the figures. The page contains PNG files and captions (`.txt`),
        and links to the other files.
    checks : results of `icha.analysis.checks.check_campaign`.
    model_error : result of `icha.analysis.model_error.model_error`; None for a campaign without boundary elements.
    answers : result of `icha.uncertainty.estimates.estimate_campaign`; None without answers.
    sensitivity : result of `icha.uncertainty.sensitivity.sensitivity_of_campaign`; None without sampled parameters.
    surfaces : datasets of the surfaces, with or without heights, for statistics and power spectra.
    configuration : text of the configuration as used.
    files : files to which the page links, by their titles; the first file is the campaign dataset.
    results : folder of the results of the campaign, for links to runs.
    citations : further sources to cite, such as sources of measurements.
    """

    def link(target):
        """Return the path of a file relative to the folder of the page."""
        return Path(os.path.relpath(target, Path(path).parent)).as_posix()

    checks, surfaces = list(checks), list(surfaces)
    studies = {name: node.to_dataset() for name, node in campaign.children.items()}
    reasons, not_valid = tables.failures(studies, link(Path(results, "runs")) if results is not None else None)
    values = {
        "title": campaign.attrs.get("title", "Rough contact campaign"),
        "summary": campaign.attrs.get("summary", ""),
        "attributes": campaign.attrs,
        "runs": sum(map(tables.count_runs, studies.values()), Counter()),
        "statements": statements_on_results(campaign, model_error),
        "answers": [] if answers is None else [_answers(name, node) for name, node in answers.children.items()],
        "samples": []
        if sensitivity is None
        else [_sample(node.to_dataset()) for node in sensitivity.children.values()],
        "reasons": reasons,
        "not_valid": not_valid,
        "figures": _pictures(figures, link),
        "parameters": [tables.studies_table(studies), tables.materials_table(studies), tables.surfaces_table(surfaces)],
        "sources": tables.sources_table(surfaces),
        "spectra": picture_of_spectra(surfaces),
        "checks": checks,
        "checked": tables.checks_tables(checks),
        "files": {name: link(target) for name, target in files.items()},
        "study": next(iter(studies), ""),
        "configuration": configuration,
        "software": {name: version(name) for name in SOFTWARE},
        "paper": MODEL_PAPER.line,
        "references": _references(campaign, model_error, citations),
        "folded": FOLDED_ROWS,
        "most_rows": MOST_ROWS,
    }
    write_page(path, "report.html", **values)


def _answers(name, node):
    """Return the answers of a study for the page: name, sentences and table."""
    rows = answers_of(node.to_dataset())
    return {"study": name, "sentences": sentences(rows), "table": answers_table(rows)}


def _sample(data):
    """Return the sampled cases of a study for the page: name, number of cases, distributions, omissions and table."""
    return {
        "study": data.attrs["study"],
        "cases": format_count(data.sizes["case"], "case"),
        "distributions": [distribution_words(data, name) for name in data["parameter"].values.tolist()],
        "left_out": left_out_of_samples(data),
        "table": samples_table(data),
    }


def _pictures(files, link) -> list[dict]:
    """Return the figures of the page in the order of their files. The number of a figure is part of its name."""
    figures: dict[str, dict[str, Path]] = {}
    for file in map(Path, files):
        figures.setdefault(file.stem, {})[file.suffix] = file
    return [
        {
            "name": name,
            "number": figure_number(name) or name,
            "caption": of_figure.pop(".txt").read_text(encoding="utf-8").strip(),
            "data": base64.b64encode(of_figure[".png"].read_bytes()).decode("ascii"),
            "files": {suffix[1:].upper(): link(file) for suffix, file in of_figure.items()},
        }
        for name, of_figure in figures.items()
    ]


def _references(campaign, model_error, citations):
    """Return the publications of the methods and of the data, each once."""
    nodes = [*campaign.children.values(), *(model_error.children.values() if model_error is not None else ())]
    texts = [each.strip() for node in nodes for each in node.attrs.get("references", "").split(";")]
    methods = [f"{each}." for each in texts if each and MODEL_PAPER.line not in each]
    return list(dict.fromkeys([*methods, *citations]))
