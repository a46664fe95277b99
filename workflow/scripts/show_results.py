"""Print where the results of a campaign are: `python show_results.py [CONFIGURATION]`."""

import sys

from icha.configuration.load import load_configuration


def show_results(configuration="config/config.yaml"):
    """Print where the results of the campaign of a configuration file are."""
    name = load_configuration(configuration).campaign.name
    results = f"results/{name}"
    print(f"figures: {results}/figures/\ndataset: {results}/dataset/{name}.nc\nreport:  {results}/report.html")


if __name__ == "__main__":
    show_results(*sys.argv[1:])
