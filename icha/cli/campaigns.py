"""The command `icha list`: print the campaigns of this folder, and the state of their results."""

import time

from icha.cli.project import Folder, echo, list_campaigns, project, shorten_path


def list_(folder: Folder = None) -> None:
    """Print all campaigns: number of computed runs, runs with changed settings, failed runs, and the last change.

    The list contains the campaigns of the project and those that come with ICHA. The command computes nothing.
    """
    from collections import Counter

    from rich.console import Console
    from rich.table import Table

    from icha.configuration.errors import ConfigurationError
    from icha.configuration.load import load_configuration
    from icha.planning.plan import CHANGED, DONE, FAILED, plan

    home = (folder or project()).resolve()
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("campaign", "runs", "done", "changed", "failed", "last change", "configuration"):
        table.add_column(heading, justify="right" if heading in ("runs", "done", "changed", "failed") else "left")
    wrong = []
    for name, path in sorted(list_campaigns().items()):
        try:
            campaign = load_configuration(path, results=home / "results").campaign
        except ConfigurationError as error:
            wrong.append(str(error).splitlines()[0])
            continue
        results = home / "results" / campaign.name
        states = Counter(item.state for item in plan(campaign, results) if item.is_run)
        counts = [str(states[state] or "") for state in (DONE, CHANGED, FAILED)]
        dataset = results / "dataset" / f"{campaign.name}.nc"
        changed = time.strftime("%Y-%m-%d %H:%M", time.localtime(dataset.stat().st_mtime)) if dataset.is_file() else ""
        table.add_row(name, str(states.total()), *counts, changed, str(shorten_path(path)))
    Console(width=None if Console().is_terminal else 120, highlight=False).print(table)
    for line in wrong:
        echo(f"cannot be read: {line}", fg="red")
