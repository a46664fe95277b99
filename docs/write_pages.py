"""Write the pages of the documentation that are made of the results of the campaigns `validation` or `hysteresis`."""

import argparse
import shutil
from pathlib import Path

from pages import error_sources, hysteresis, one_asperity, validation

from icha.configuration.cases import asperity_cases, loop_cases, source_cases
from icha.configuration.load import load_configuration
from icha.datasets.files import read_campaign, read_dataset
from icha.support.atomic_files import whole_file

DOCS = Path("docs")


def write_pages(name):
    """Write the pages that are made of a campaign's results, and copy their figures."""
    campaign = load_configuration(Path(f"config/campaigns/{name}.yaml")).campaign
    pages, figures = PAGES[name](campaign, Path("results", name), f"make {name}")
    for figure in figures:
        with whole_file(DOCS / f"images/{figure}.png") as temporary:
            shutil.copyfile(f"results/{name}/figures/{figure}.png", temporary)
    for page, text in pages.items():
        with whole_file(DOCS / f"{page}.md") as temporary:
            temporary.write_text(text, encoding="utf-8")


def validation_pages(campaign, results, command):
    """How far the model is from boundary elements, and why."""

    def sources(entry):
        cases = [case for case in source_cases(campaign) if case.entry == entry]
        return [read_dataset(results / f"references/error_sources/{case.path}.nc") for case in cases]

    asperities = {
        name: read_dataset(results / f"references/one_asperity/{name}.nc") for name in asperity_cases(campaign)
    }
    hertz = asperities.pop("hertz")
    pages = {
        "validation": validation.page(
            read_campaign(results / "aggregated/model_error.nc"),
            entries={"adhesionless": "Without adhesion", "adhesive": "With adhesion"},
            grids={"adhesionless": "2 cells", "coarse": "1 cell", "fine": "4 cells"},
            ranges={"adhesionless": ["ranges", "shortest_range"]},
            figures={
                "images/fig10_model_error.png": "Relative error of contact area and mean separation against load; with "
                "adhesion dotted against the energetic area. Coarse and fine: of one seed, on other grids",
                "images/fig11_distribution_error.png": "Distances of the distributions of pressure and of gap, and "
                "overlap of the contact maps",
            },
            command=command,
            further=one_asperity.section(list(asperities.values()), hertz),
        ),
        "error_sources": error_sources.page(
            sources("adhesionless"), sources("adhesive"), figure="images/fig12_error_sources.png", command=command
        ),
    }
    return pages, ("fig10_model_error", "fig11_distribution_error", "fig12_error_sources")


def hysteresis_pages(campaign, results, command):
    """Pull-off and what is lost on the way back."""
    cases = loop_cases(campaign)
    loops = {
        entry.study: [
            read_dataset(results / f"references/loops/{case.path}.nc") for case in cases if case.entry == name
        ]
        for name, entry in campaign.boundary_element_loops.items()
    }
    page = hysteresis.page(
        read_campaign(results / f"dataset/{campaign.name}.nc"),
        slopes="slopes",
        detachment="detachment",
        loads=campaign.figures.fig14_pull_off.load_studies,
        load_control="load_control",
        loops=loops,
        figures={
            "images/fig13_loops.png": "Pressure and contact area against mean separation, in and back",
            "images/fig14_pull_off.png": "Pull-off against rms slope, and against the largest load",
            "images/fig15_loss.png": "Energy lost against contact area, and what it was lost in",
            "images/fig16_snap_map.png": "Where and when spots snap into and out of contact",
        },
        command=command,
    )
    return {"hysteresis": page}, ("fig13_loops", "fig14_pull_off", "fig15_loss", "fig16_snap_map")


PAGES = {"validation": validation_pages, "hysteresis": hysteresis_pages}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaign", choices=PAGES)
    write_pages(parser.parse_args().campaign)
