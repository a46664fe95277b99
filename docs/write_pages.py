"""Write the pages of the documentation whose numbers are results.

They are those of the campaigns `validation` or `hysteresis`, or what benchmarks/short_range.py kept (`short_range`).
Their words are in docs/templates, the numbers in them computed by the functions of docs/pages.
"""

import argparse
import json
import re
import shutil
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from pages import error_sources, hysteresis, one_asperity, rules, short_range, validation

from icha.configuration.cases import asperity_cases, loop_cases, source_cases
from icha.configuration.load import load_configuration
from icha.datasets.files import read_campaign, read_dataset
from icha.support.atomic_files import whole_file

DOCS = Path(__file__).parent
TEMPLATES = Environment(
    loader=FileSystemLoader(DOCS / "templates"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    autoescape=False,  # Markdown, of our own results
)
for functions in (error_sources, hysteresis, one_asperity, rules, short_range, validation):
    TEMPLATES.globals[functions.__name__.rpartition(".")[2]] = functions


def render(page, **given):
    """The text of a page, in Markdown, from its template and datasets."""
    return TEMPLATES.get_template(f"{page}.md.jinja").render(given).rstrip() + "\n"


def validation_pages(campaign, results):
    """How far the model is from boundary elements, and why."""
    cases = source_cases(campaign)
    sources = {
        entry: [
            read_dataset(results / f"references/error_sources/{case.path}.nc") for case in cases if case.entry == entry
        ]
        for entry in ("adhesionless", "adhesive")
    }
    asperities = {
        name: read_dataset(results / f"references/one_asperity/{name}.nc") for name in asperity_cases(campaign)
    }
    errors = read_campaign(results / "aggregated/model_error.nc")
    ways = loop_cases(campaign)
    return {
        "validation": {
            "campaign": read_campaign(results / f"dataset/{campaign.name}.nc"),
            "loops": {
                entry.study: [
                    read_dataset(results / f"references/loops/{case.path}.nc") for case in ways if case.entry == name
                ]
                for name, entry in campaign.boundary_element_loops.items()
            },
            "model_error": {name: entry.to_dataset() for name, entry in errors.children.items()},
            "hertz": asperities.pop("hertz"),
            "adhesive": list(asperities.values()),
        },
        "error_sources": sources,
    }


def hysteresis_pages(campaign, results):
    """Pull-off and what is lost on the way back."""
    tree = read_campaign(results / f"dataset/{campaign.name}.nc")
    studies = {name: study.to_dataset() for name, study in tree.children.items()}
    return {
        "hysteresis": {
            "campaign": tree,
            "studies": studies,
            "load_studies": [studies[name] for name in campaign.figures.fig14_pull_off.load_studies],
        }
    }


PAGES = {"validation": validation_pages, "hysteresis": hysteresis_pages}


def write_pages(name):
    """Write the pages that are made of a campaign's results, and copy the figures that they show."""
    campaign = load_configuration(Path(f"config/campaigns/{name}.yaml")).campaign
    for page, given in PAGES[name](campaign, Path("results", name)).items():
        text = render(page, command=f"make {name}", **given)
        for figure in re.findall(r"\]\(images/(.*?\.png)\)", text):
            with whole_file(DOCS / "images" / figure) as temporary:
                shutil.copyfile(f"results/{name}/figures/{figure}", temporary)
        with whole_file(DOCS / f"{page}.md") as temporary:
            temporary.write_text(text, encoding="utf-8")


def write_short_range(results=DOCS.parent / "benchmarks/results/short_range", page=DOCS / "short_range.md"):
    """Write the page of the proof of the boundary elements from what was measured."""
    parts = {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in sorted(results.glob("*.json"))}
    with whole_file(page) as temporary:
        temporary.write_text(render("short_range", measured=parts), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", choices=[*PAGES, "short_range"])
    chosen = parser.parse_args().results
    if chosen == "short_range":
        write_short_range()
    else:
        write_pages(chosen)
