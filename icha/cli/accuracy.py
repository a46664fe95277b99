"""Add seeds to the studies with `accuracy`, as a part of the command `icha run`."""

from collections.abc import Callable
from pathlib import Path

from icha.cli.project import echo
from icha.support import formatting

# Largest number of times that the seeds of a study are increased to reach its accuracy.
_MOST_EXTENSIONS = 2


def reach_accuracy(campaign, path: Path, folder: Path, cores: int, compute: Callable):
    """Increase the seeds of studies with `accuracy` until all intervals are narrow enough.

    `folder` contains results/; `compute` computes targets of a campaign. Return the campaign with the last seeds, and
    the last choice of each study (`icha.planning.levels`).
    """
    from icha.configuration.load import load_configuration
    from icha.planning.levels import choose_levels, words_of_levels, write_levels

    results, choices = folder / "results" / campaign.name, {}
    if all(study.accuracy is None for study in campaign.studies.values()):
        return campaign, choices
    from icha.planning.results import campaign_files

    for extension in range(_MOST_EXTENSIONS + 1):
        # The target `dataset` includes the verdict, which one failed run is enough to stop.
        compute(campaign, ["runs", f"results/{campaign.name}/{campaign_files(campaign).dataset}"])
        choices = choose_levels(campaign, results, cores)
        extended = {name: choice for name, choice in choices.items() if choice.counts}
        if not extended or extension == _MOST_EXTENSIONS:
            break
        for name, choice in extended.items():
            time = formatting.duration(choice.seconds / cores)
            echo(f"{name}: {choice.sentence}; next: {words_of_levels(choice.counts)}, {time} in all", bold=True)
        write_levels(results, extended)
        campaign = load_configuration(path, results=folder / "results").campaign
    return campaign, choices


def print_accuracy(choices) -> None:
    """Print the accuracy that each study has reached, and the reason if it is not the required one."""
    for name, choice in choices.items():
        reached = choice.half_width <= choice.required
        reason = "" if reached else f". Not reached: {choice.reason or 'repeat the command to add seeds'}"
        echo(f"answer:   study {name}: {choice.sentence}{reason}", fg=None if reached else "yellow")
