"""Compute a deposit again, by the program that is installed or by its own, and compare."""

import shutil
import tempfile
import textwrap
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import typer

from icha.cli.deposits import agree, flaws_of, listed
from icha.cli.project import FAILED, Anyway, Cores, Large, Mistake, say, shown
from icha.cli.rerun_programs import fail, run_installed, run_own_source, stopped_by_signals
from icha.deposit.strangers_files import Found
from icha.support import in_words
from icha.support.in_words import counted, printable


def reproduce(
    deposit: Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)],
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RUN",
            help="Only this run and the surface that it needs; can be given several times. Either "
            "study/surface/seed1/slope1/material or `smallest`, the complete run with the least data.",
            show_default=False,
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder to compute in; the same folder again continues. Left out: a temporary one, which is removed "
            "if everything is reproduced.",
            show_default=False,
        ),
    ] = None,
    cores: Cores = None,
    own_source: Annotated[
        bool, typer.Option("--own-source", help="Run the program that is in the deposit, which may do anything.")
    ] = False,
    environment: Annotated[
        Literal["lock", "here"] | None,
        typer.Option(
            help="Of its own source: lock (if left out) installs what its lock file says; here uses what is there, if "
            "it agrees.",
            show_default=False,
        ),
    ] = None,
    isolation: Annotated[
        Literal["bwrap", "podman", "docker", "none"] | None,
        typer.Option(
            help="Of its own source: what keeps it to the folder, and off the network once all is installed. Left out: "
            "bwrap, where that works.",
            show_default=False,
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="Do not ask; with --isolation none also where nothing isolates.")
    ] = False,
    anyway: Anyway = False,
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the comparison to this file.", show_default=False)
    ] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Keep the temporary folder in any case.")] = False,
    large: Large = False,
) -> None:
    """Compute a deposit again and compare every number with it.

    The deposit is verified and only read. Its configuration is run by the ICHA that is installed, if its version and
    those of all packages are those of the deposit; nothing in the deposit is executed. With --own-source the program in
    the deposit is run instead, in the environment of its lock file (that needs network, make and Python); you are told
    what that means, and asked. Everything that was computed is compared, variable by variable: identical, within
    tolerance, or different. With `--only smallest` this takes minutes.

    Exit status: 0 if all is identical or within tolerance, 1 if not, or if computing fails or is stopped, 2 if the
    deposit is damaged or not there, or nothing is computed for another reason.
    """
    from icha.deposit.deposit_files import whole_deposit

    if not own_source and (environment or isolation):
        given = "--environment" if environment else "--isolation"
        raise Mistake(f"{given}: is about the deposit's own source, which is not run; needed: --own-source as well")
    if wrong := flaws_of(deposit, large=large):
        raise Mistake(f"{printable(deposit)}: the deposit is damaged; needed: a whole one:\n{listed(wrong)}")
    temporary = folder is None
    with whole_deposit(deposit) as found:
        rerun = _agreed(found, only or (), own_source, environment, isolation, folder, yes)
        folder = Path(tempfile.mkdtemp(prefix="icha-reproduce-") if temporary else folder).resolve()
        try:
            made, comparison, status = _computed_again(rerun, folder, cores, anyway)
        except (Mistake, OSError):
            if temporary:
                shutil.rmtree(folder)
            raise
    good = _tell(comparison, status)
    if temporary and good and not keep:
        shutil.rmtree(folder)
    else:
        say(f"what was computed again: {shown(made)}")
    if json:
        from icha.deposit.rerun_comparison import write_json

        write_json(comparison, json)
    if not good:
        raise typer.Exit(FAILED)


class _Rerun(NamedTuple):
    """What is computed again, and how: by the deposit's own program, with an environment and isolation, or not."""

    deposit: Found
    campaign: dict
    runs: list[str]
    own_source: tuple[str, str] | None


def _agreed(deposit: Found, only, own_source: bool, environment, isolation, folder: Path | None, yes: bool) -> _Rerun:
    """What is asked for of a deposit that is whole, after telling of it and asking."""
    from icha.deposit.rerun import LOCK, OWN_SOURCE, PYPROJECT, Refused, asked_runs, campaign_of

    place = shown(folder) if folder else "a temporary folder"
    try:
        campaign = campaign_of(deposit, OWN_SOURCE if own_source else (PYPROJECT, LOCK))
        runs = asked_runs(only, deposit)
        how = (environment or "lock", _isolation(isolation, environment, yes)) if own_source else None
        _tell_what_it_says(deposit)
        if how:
            _tell_of_own_source(*how, place)
            agree("Run it?", yes=yes, done="run")
        else:
            _tell_of_installed(deposit, place)
    except Refused as refused:
        raise Mistake(str(refused)) from None
    return _Rerun(deposit, campaign, runs, how)


def _isolation(asked: str | None, environment: str | None, yes: bool) -> str:
    """The program that isolates: the one that is asked for, or `bwrap` where it works."""
    from icha.deposit.isolation import BWRAP, CONTAINERS, NO_ISOLATION, works

    if asked == NO_ISOLATION:
        return NO_ISOLATION
    if asked in CONTAINERS and environment == "here":
        raise Mistake(f"--isolation {asked}: cannot use what is installed here; allowed: bwrap, none")
    if works(asked or BWRAP):
        return asked or BWRAP
    if asked:
        raise Mistake(f"--isolation {asked}: is not installed, or cannot isolate here; allowed: another one, or none")
    if yes:
        raise Mistake(
            f"--yes: {BWRAP} is not installed, or cannot isolate here, so that the deposit's program could do whatever "
            "you can, and nobody is asked; needed: --isolation none as well, or another --isolation"
        )
    return NO_ISOLATION


def _tell_what_it_says(deposit: Found) -> None:
    """Print what the deposit is, and what it says of itself."""
    from icha.deposit.deposit_files import ZENODO
    from icha.deposit.statement import metadata_of, statement

    sizes, said = deposit.sizes, {}
    if ZENODO in sizes:
        try:
            said = {name: text for name, text in statement(metadata_of(deposit)).items() if text}
        except ValueError as error:
            raise Mistake(f"{printable(deposit.path)}: {error}") from None
    say(f"deposit:    {printable(deposit.path)}, {counted(len(sizes), 'file')}, {in_words.size(sum(sizes.values()))}")
    say("it says of itself, and nobody has checked it:" if said else "it does not say whose it is")
    for name, text in said.items():
        say(f"  {name + ':':<10}{printable(textwrap.shorten(text, 200, placeholder=' …'))}")


def _tell_of_installed(deposit: Found, place) -> None:
    """Print that the installed program is run; `Mistake` if it is not the one that made the deposit."""
    from icha.deposit.rerun import changed_files, unlike_installed

    if wrong := unlike_installed(deposit):
        raise Mistake(
            f"what is installed is not what {printable(deposit.path)} was made with; needed: these versions, as "
            "`make environment` installs them in a clone of that version; or --own-source, which runs the program in "
            "the deposit:\n" + "\n".join(wrong)
        )
    say(f"is run:     the ICHA that is installed, {version('icha')}; nothing in the deposit is executed")
    if changed := changed_files(deposit):
        say(f"            (the deposit's source differs from it in {counted(changed, 'file')})", fg="yellow")
    say(f"can touch:  {place}")


def _tell_of_own_source(environment: str, isolation: str, place) -> None:
    """Print that the deposit's own program is run, what it can touch, and what is better."""
    from icha.deposit.isolation import BWRAP, CONTAINERS, NO_ISOLATION, works
    from icha.deposit.rerun import PROJECT, surroundings

    first = "" if environment == "here" else "its `make environment`, and then "
    say(f"is run:     the program in the deposit: {first}its `icha run`")
    if isolation == NO_ISOLATION:
        say("can touch:  whatever you can: your files, your network, your programs", fg="red")
        there = next((name for name in CONTAINERS if works(name)), None)
        advice = f"with --isolation {there}" if there else f"install {BWRAP} (bubblewrap), which is then used"
        say(f"advice:     run it isolated: {advice}", fg="yellow")
    else:
        until = "no network" if environment == "here" else "the network until its environment is installed"
        say(f"can touch:  {PROJECT} in {place}, and by {isolation} nothing else; {until}")
    say(f"variables:  {', '.join(sorted(surroundings()))}; no other ones of yours")


def _computed_again(rerun: _Rerun, folder: Path, cores: str | None, anyway: bool):
    """The folder with the results, their comparison with the deposit's, and the exit status of the campaign."""
    from icha.deposit.rerun import Refused, begin, prepare, refuse_wrong_configuration

    goes_on = f"the same command with --folder {shown(folder)} goes on from here"
    name = rerun.campaign["name"]
    options = [*(["--cores", cores] if cores else []), *(["--anyway"] if anyway else [])]
    try:
        with stopped_by_signals():
            begin(folder, rerun.deposit)
            project, original = prepare(folder, rerun.deposit, own_source=bool(rerun.own_source))
            say(f"computing in {shown(project)}")
            asked = [*([f"results/{name}/{run}" for run in rerun.runs] or ["all"]), *options]
            if rerun.own_source:
                status = run_own_source(project, rerun.deposit, rerun.campaign, asked, *rerun.own_source)
            else:
                refuse_wrong_configuration(project)
                status = run_installed(project, asked)
            made = project / "results" / name
            if not made.is_dir() or made.resolve() != made:  # a link may lead to results that nobody computed
                fail(f"nothing was computed; {goes_on}")
            return made, _compared(original, made, rerun.runs, rerun.deposit.sizes), status
    except Refused as refused:
        raise Mistake(str(refused)) from None
    except KeyboardInterrupt:
        fail(f"stopped; {goes_on}")


def _compared(original: Path, made: Path, runs: list[str], sizes):
    from icha.deposit.rerun import surface_of
    from icha.deposit.rerun_comparison import compare_folders

    paths = None
    if runs:
        paths = [*runs, *(surface for surface in map(surface_of, runs) if surface in sizes)]
    return compare_folders(original, made, paths)


def _tell(comparison, status: int) -> bool:
    """Print the comparison; return whether all is reproduced."""
    from icha.deposit.rerun_comparison import DIFFERENT, IDENTICAL, TOLERANCE, table

    say(f"\nthe deposit, and what was computed again:\n\n{table(comparison)}\n")
    files = counted(len(comparison.files), "file")
    if not comparison.files:
        say("nothing was compared, so nothing is reproduced", fg="red")
        return False
    if comparison.verdict == DIFFERENT:
        say("different: not everything is reproduced", fg="red")
    elif comparison.verdict == IDENTICAL:
        say(f"identical: {files}, every value", fg="green")
    else:
        say(f"within tolerance: {files}, every value to {TOLERANCE:g}", fg="green")
    if status:
        say("Not everything could be computed: see above.", fg="yellow")
    return comparison.verdict != DIFFERENT
