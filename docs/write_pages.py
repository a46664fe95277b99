"""Write the pages of the documentation that are made of the results of campaign `validation`."""

import shutil
from pathlib import Path

from icha.configuration.expansion import asperity_cases, source_cases
from icha.configuration.load import load_configuration
from icha.files import whole_file
from icha.pages import error_sources, one_asperity, validation
from icha.records import read_campaign, read_dataset

COMMAND = "make validation"
CONFIGURATION = Path("config/campaigns/validation.yaml")
RESULTS = Path("results/validation")
DOCS = Path("docs")


def main():
    """Write the pages and copy their figures."""
    for name in ("fig10_model_error", "fig11_distribution_error", "fig12_error_sources"):
        with whole_file(DOCS / f"images/{name}.png") as temporary:
            shutil.copyfile(RESULTS / f"figures/{name}.png", temporary)

    campaign = load_configuration(CONFIGURATION).campaign

    def sources(entry):
        cases = [case for case in source_cases(campaign) if case.entry == entry]
        return [read_dataset(RESULTS / f"references/error_sources/{case.path}.nc") for case in cases]

    asperities = {
        name: read_dataset(RESULTS / f"references/one_asperity/{name}.nc") for name in asperity_cases(campaign)
    }
    hertz = asperities.pop("hertz")
    pages = {
        "validation": validation.page(
            read_campaign(RESULTS / "aggregated/model_error.nc"),
            entries={"adhesionless": "Without adhesion", "adhesive": "With adhesion"},
            grids={"adhesionless": "2 cells", "coarse": "1 cell", "fine": "4 cells"},
            ranges={"adhesionless": ["ranges", "shortest_range"]},
            figures={
                "images/fig10_model_error.png": "Relative error of contact area and mean separation against load; with "
                "adhesion dotted against the energetic area. Coarse and fine: of one seed, on other grids",
                "images/fig11_distribution_error.png": "Distances of the distributions of pressure and of gap, and "
                "overlap of the contact maps",
            },
            command=COMMAND,
            further=one_asperity.section(list(asperities.values()), hertz),
        ),
        "error_sources": error_sources.page(
            sources("adhesionless"), sources("adhesive"), figure="images/fig12_error_sources.png", command=COMMAND
        ),
    }
    for name, text in pages.items():
        with whole_file(DOCS / f"{name}.md") as temporary:
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
