"""The command `icha describe`: print what a campaign computes, which results exist, and the cost of missing results."""

import statistics
import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import (
    DEFAULT_CORES,
    Config,
    Cores,
    Folder,
    echo,
    find_configuration,
    project,
    read_configuration,
    shorten_path,
)
from icha.cli.scans import describe_scan
from icha.support import formatting
from icha.support.formatting import format_count, printable_lines


def describe(
    config: Config = None,
    runs: Annotated[bool, typer.Option("--runs", help="List every file, not only totals.")] = False,
    cores: Cores = None,
    folder: Folder = None,
    plot: Annotated[
        bool, typer.Option("--plot", help="Draw each measured surface before and after its preparation.")
    ] = False,
) -> None:
    """Print what a campaign computes, which results exist, and the time, memory and disk space for missing results.

    The command computes nothing. Times are estimates, usually right within a factor of two. A run counts as done if its
    file was computed with the present settings and the present program. For each measured surface, the command prints
    the number of summits, whether the spectrum ends in noise, and recommended keys.
    """
    path, home = find_configuration(config), (folder or project()).resolve()
    campaign = read_configuration(path, home).campaign
    print_plan(path, campaign, home, cores or DEFAULT_CORES, runs=runs)
    _print_scans(campaign, home / "results" / campaign.name if plot else None)


def _print_scans(campaign, plots: Path | None) -> None:
    """Print what the files of surfaces contain; draw measured surfaces to the folder `plots`, if given."""
    from icha.configuration.surfaces import MeasuredSurface, SpectrumSurface
    from icha.contact.models import MODELS

    for name in campaign.used_surfaces:
        section = campaign.surfaces[name]
        if isinstance(section, SpectrumSurface):
            echo("\n".join(f"{name}: {line}" for line in _spectrum_lines(section)))
        elif isinstance(section, MeasuredSurface):
            from icha.surfaces.measured.resolution import examine_scan

            models = [MODELS[run.model] for run in campaign.all_runs if run.surface == name]
            lines = describe_scan(name, examine_scan(section.path, section.preparation), models=models)
            echo("\n".join(["", *lines]))
            if plots is not None:
                _draw_scan(section, plots / f"scan_{name}.png")


def _spectrum_lines(section):
    """Yield the sources of a table of a spectrum, and the rms height and slope that follow from its convention."""
    from icha.surfaces.tabulated_spectrum import CONVENTIONS, read_spectrum_table

    table = read_spectrum_table(section.path, section.length_unit, section.convention)
    yield from table.sources
    cell, convention = table.in_cell(section.period), section.convention or "surface"
    given = table.profile_height or table.rms_height
    given, whole, part = (formatting.length(float(f"{x:.3g}")) for x in (given, table.rms_height, cell.rms_height))
    surface = f"rms height {whole} of the isotropic surface with these profiles; " if table.profile_height else ""
    yield (
        f"rms height {given} of the table, from {CONVENTIONS[convention].meaning} (convention {convention}); {surface}"
        f"rms height {part} and rms slope {cell.rms_slope:.3g} in the cell"
    )


def _draw_scan(section, file: Path) -> None:
    """Draw a measured surface before and after its preparation."""
    from icha.figures.preparation import draw_preparation
    from icha.surfaces.measured.resolution import without_preparation
    from icha.surfaces.measured.topography import prepared_topography

    before = without_preparation(section.path, section.preparation)
    file.parent.mkdir(parents=True, exist_ok=True)
    draw_preparation(before, prepared_topography(section.path, section.preparation).surface).savefig(file)
    echo(f"before and after the preparation: {shorten_path(file)}")


def print_plan(path: Path, campaign, home: Path, cores: int, *, runs=False, local=True) -> None:
    """Print what a campaign computes, which results exist, the cost of missing results, and what prevents a run.

    `home` contains results/; with `runs`, every file has a line; `local` is False if jobs run on other machines.
    """
    from rich.console import Console
    from rich.text import Text

    from icha.deposit.metadata import licence_problem
    from icha.planning.ownership import find_conflict
    from icha.planning.plan import FAILED, OUTDATED, find_shortages, plan
    from icha.planning.validity import expected_validity

    results = home / "results" / campaign.name
    items = plan(campaign, results)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)

    def print_line(style: str, name: str, text: object):
        console.print(Text.assemble((name, style), ": ", printable_lines(text)), soft_wrap=True)

    print_line("bold", campaign.name, campaign.title)
    print_line("", "configuration", f"{shorten_path(path)}\n")
    if runs:
        _print_files(console, items)
    _print_sums(console, items)
    _print_cost(console, items, cores)
    for name, study in campaign.studies.items():
        if study.accuracy is not None:
            print_line("bold", "answer", _accuracy(name, study))
    for reason, count in Counter(item.reason for item in items if item.state == OUTDATED).items():
        print_line("red", "outdated", f"{format_count(count, 'file')}, because {reason}: will be computed again")
    for item in items:
        if item.state == FAILED:
            print_line("red", "failed", f"{item.path}: {item.reason}")
    for statement in expected_validity(campaign):
        print_line("bold" if statement.good else "bold yellow", statement.about, statement.text)
    problem = licence_problem(campaign)
    obstacles = {
        "cannot be run": find_conflict(shorten_path(results), path),
        "cannot be published": problem and f"{shorten_path(path)}: {': '.join(problem)}",
    }
    for name, reason in obstacles.items():
        if reason:
            print_line("red", name, reason)
    for shortage in find_shortages(items, cores, results, local=local):
        print_line("red", "too small", shortage)


def _accuracy(name: str, study) -> str:
    """Return a sentence on the seeds of a study with `accuracy`: the pilot, or the seeds that ICHA has chosen."""
    from icha.configuration.studies import PILOT
    from icha.datasets.quantities import quantity
    from icha.planning.levels import quantity_of, words_of_levels

    levels = study.seeds_of_levels
    wanted = f"± {100 * study.accuracy.half_width:.3g} % of the {quantity(quantity_of(study.accuracy, study)).name}"
    counts = {key: len(seeds) for key in type(levels).model_fields if (seeds := getattr(levels, key))}
    pilot = "a pilot of " if levels == PILOT else ""
    return f"study {name}, {wanted}: {pilot}{words_of_levels(counts)}"


def _print_files(console, items) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("file", "state", "time", "memory", "disk"):
        table.add_column(heading, justify="left" if heading in ("file", "state") else "right", overflow="fold")
    for item in items:
        sizes = (formatting.size(size) for size in (item.cost.memory, item.cost.disk))
        table.add_row(item.path, item.state, formatting.duration(item.cost.seconds), *sizes)
    console.print(table)
    console.print()


def _print_sums(console, items) -> None:
    """Print a table of numbers of files, times, memory and disk space, with a row for each kind of result."""
    from rich.table import Table

    from icha.planning.plan import DONE, FAILED

    def cells(items):
        left = [item for item in items if item.to_do]
        states = [item.state for item in items]
        counts = len(items), states.count(DONE), states.count(FAILED), len(left)
        each = formatting.duration(statistics.median(item.cost.seconds for item in items))
        work = formatting.duration(sum(item.cost.work for item in left)) if left else ""
        memory, disk = max(item.cost.memory for item in items), sum(item.cost.disk for item in items)
        return [*(str(count or "") for count in counts), each, work, formatting.size(memory), formatting.size(disk)]

    table = Table(box=None, pad_edge=False, header_style="dim", show_footer=True)
    table.add_column("", footer="all", overflow="fold")
    headings = ("files", "done", "failed", "to do", "each", "core time", "memory", "disk")
    for heading, footer in zip(headings, cells(items), strict=True):
        # In a narrow terminal, only names are wrapped, not numbers.
        table.add_column(heading, footer="" if heading == "each" else footer, justify="right", no_wrap=True)
    for group in dict.fromkeys(item.group for item in items):
        table.add_row(group, *cells([item for item in items if item.group == group]))
    console.print(table)
    console.print()


def _print_cost(console, items, cores: int) -> None:
    from icha.planning.plan import RUNS, memory_on, time_on

    runs = [item for item in items if item.part == RUNS]
    if any(item.to_do for item in items):
        time, memory = formatting.duration(time_on(items, cores)), formatting.size(memory_on(items, cores))
        disk = formatting.size(sum(item.cost.disk for item in items))
        console.print(
            f"{format_count(len(runs), 'run')}, {sum(item.to_do for item in runs)} to do: about [bold]{time}[/] and "
            f"{memory} of memory on {format_count(cores, 'core')}; {disk} of disk space for all results."
        )
    else:
        console.print(f"{format_count(len(runs), 'run')}; all results exist.")
