"""Check configuration files: `python -m icha.configuration FILE…`."""

import sys

from icha.configuration.expansion import run_cases
from icha.configuration.load import ConfigurationError, load_configuration
from icha.configuration.problems import warnings


def check(path: str) -> None:
    """Say what a configuration asks for, or end the program with all that is wrong with it."""
    try:
        campaign = load_configuration(path).campaign
    except ConfigurationError as error:
        raise SystemExit(f"The configuration cannot be run:\n{error}") from None
    for warning in warnings(campaign):
        print(f"Warning: {warning}", file=sys.stderr)
    print(f"{path}: campaign {campaign.name}, {len(run_cases(campaign))} runs")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        check(name)
