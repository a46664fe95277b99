"""Tell what a campaign asks for, what of it is there, and what the rest will cost."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import (
    Config,
    Cores,
    Folder,
    UserError,
    configuration_path,
    core_count,
    echo,
    markup,
    profile_settings,
    project,
    read_configuration,
    shown,
    workflow_folder,
)
from icha.cli.scans import about_scan, check_picture
from icha.support import formatting
from icha.support.formatting import format_count


def describe(
    config: Config = None,
    runs: Annotated[bool, typer.Option("--runs", help="List every file, not only the sums.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the measured surfaces, with their spectra, into this file (.png, .pdf or .svg).",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    folder: Folder = None,
) -> None:
    """Show what a campaign computes: its runs, what is there already, and expected time, memory and disk of the rest.

    Nothing is computed. Times are estimates, good to about a factor of two; once some runs are done, their times are
    used. A run counts as done if its file was made with the present settings; `icha run -n` also sees changes of the
    program. Of measured surfaces it says how many summits they have, whether their spectra end in noise, and what is
    advisable then.
    """
    check_picture(plot)
    path = configuration_path(config)
    campaign = read_configuration(path).campaign
    tell(path, campaign, workflow_folder(), (folder or project()).resolve(), core_count(cores), runs=runs)
    _tell_of_scans(campaign, plot)


def _tell_of_scans(campaign, plot: Path | None) -> None:
    """Tell of the measured surfaces that are pressed, and draw them if asked."""
    from icha.configuration.cases import run_cases
    from icha.configuration.surfaces import MeasuredSurface

    pressed = {case.surface: campaign.surfaces[case.surface] for case in run_cases(campaign)}
    measured = {name: section for name, section in pressed.items() if isinstance(section, MeasuredSurface)}
    if not measured:
        if plot is not None:
            raise UserError("--plot: draws measured surfaces; the campaign presses none")
        return
    from icha.contact.models import MODELS
    from icha.surfaces.measured.resolution import scan_resolution

    models: dict[str, list] = {}
    for case in run_cases(campaign):
        models.setdefault(case.surface, []).append(MODELS[case.model])
    scans = {name: scan_resolution(section.path, section.preparation) for name, section in measured.items()}
    echo("")
    for name, scan in scans.items():
        for line in about_scan(name, scan, models=models[name]):
            echo(line)
    if plot is not None:
        from icha.cli.quick_plot import draw_scans

        draw_scans(scans, plot)
        echo(f"drawn: {shown(plot)}")


def tell(path: Path, campaign, workflow: Path, home: Path, cores: int, *, runs: bool = False, profile=None) -> None:
    """Print what a campaign computes, what is there, what the rest costs, and what is in its way.

    Parameters
    ----------
    path : its configuration file.
    campaign : what that says.
    workflow : the folder of the workflow.
    home : the folder in which results/ stands.
    cores : number of cores that are used.
    runs : whether every file is listed.
    profile : folder of the profile of Snakemake that is used; the workflow's default one if left out.
    """
    from rich.console import Console

    from icha.deposit.metadata import licence_problem
    from icha.planning.ownership import belongs_to_another
    from icha.planning.plan import plan
    from icha.planning.requirements import missing_software, wanting
    from icha.planning.validity import expected_validity
    from icha.support.checksums import damaged

    results = home / "results" / campaign.name
    items = plan(campaign, results)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    console.print(f"[bold]{campaign.name}[/]: {markup(campaign.title)}")
    console.print(f"configuration: {markup(shown(path))}\n")
    if runs:
        _list(console, items)
    _summary(console, items, damaged(results), cores)
    for statement in expected_validity(campaign):
        _line(console, "bold", statement.about, statement.text)
    problem = licence_problem(campaign)
    obstacles = {
        "not to be run": belongs_to_another(shown(results), campaign.name, path, workflow),
        "not to be published": problem and f"{shown(path)}: {': '.join(problem)}",
        "missing": missing_software(campaign),
    }
    for about, reason in obstacles.items():
        if reason:
            _line(console, "red", about, reason)
    for lack in wanting(items, cores, results, profile_settings(profile or workflow / "profiles/default")):
        _line(console, "red", "not enough", lack)


def _line(console, style: str, about: str, text: str) -> None:
    console.print(f"[{style}]{about}:[/] {markup(text)}", soft_wrap=True)


def _summary(console, items, damaged, cores) -> None:
    from rich.table import Table

    from icha.planning.plan import around_jobs, memory_on, time_on, total

    table = Table(box=None, pad_edge=False, header_style="dim", show_footer=True)
    parts: dict[str, list] = {}
    for item in items:
        parts.setdefault(item.part, []).append(item)
    every, around = total(items), around_jobs(items)
    columns = {
        "": "all",
        "files": str(every.count),
        "done": str(every.done),
        "failed": str(every.failed or ""),
        "to do": str(every.to_do),
        "each": "",
        "core time": formatting.duration(every.work + around),
        "memory": formatting.size(every.memory),
        "disk": formatting.size(every.disk),
    }
    for heading, footer in columns.items():
        # In a narrow terminal it is the names that are broken, not the numbers.
        table.add_column(
            heading, footer=footer, justify="right" if heading else "left", no_wrap=bool(heading), overflow="fold"
        )
    for part, members in parts.items():
        sums = total(members)
        counts = (str(count or "") for count in (sums.count, sums.done, sums.failed, sums.to_do))
        work = formatting.duration(sums.work) if sums.to_do else ""
        sizes = formatting.size(sums.memory), formatting.size(sums.disk)
        table.add_row(part, *counts, formatting.duration(sums.typical), work, *sizes)
    if around:
        table.add_row("starting and scheduling", "", "", "", "", "", formatting.duration(around))
    console.print(table)
    runs = [item for item in items if item.is_run]
    changed = sum(item.state == "changed" for item in runs)
    console.print()
    if not every.to_do and not damaged:
        console.print(f"{format_count(len(runs), 'run')}; everything is there.")
    else:
        time, memory = formatting.duration(time_on(items, cores)), formatting.size(memory_on(items, cores))
        console.print(
            f"{format_count(len(runs), 'run')}, {sum(item.to_do for item in runs)} to do: about [bold]{time}[/] and "
            f"{memory} of memory on {format_count(cores, 'core')}; {formatting.size(every.disk)} of disk when all is "
            "there."
        )
    for path in damaged:
        _line(console, "red", "damaged", f"{path}: to do again.")
    if changed:
        console.print(f"{format_count(changed, 'run')} there, but with other settings: to do again.")
    for item in runs:
        if item.reason:
            console.print(f"[red]failed:[/] {item.path}: {markup(item.reason)}")


def _list(console, items) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("file", "state", "time", "memory", "disk"):
        table.add_column(heading, justify="left" if heading in ("file", "state") else "right", overflow="fold")
    for item in items:
        time, memory = formatting.duration(item.cost.seconds), formatting.size(item.cost.memory)
        table.add_row(item.path, item.state, time, memory, formatting.size(item.cost.disk))
    console.print(table)
    console.print()
