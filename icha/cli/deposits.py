"""The commands for deposits: `icha verify`, `icha reproduce` and `icha upload`."""

import contextlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from typer import confirm

from icha.cli.project import FAILED, Cores, UserError, echo, option, shorten_path
from icha.cli.run import run
from icha.support import formatting
from icha.support.formatting import format_count, printable

TOKEN = "ZENODO_TOKEN"
MOST_PROBLEMS = 100  # largest number of problems that are printed for a damaged deposit

Deposit = Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)]


def verify(deposit: Deposit) -> None:
    """Verify that a deposit contains all its files with the right checksums, and no other files.

    The command also reports file names that lead outside the deposit, links, devices, and a zip whose content is far
    larger than the zip. A zip is unpacked into a temporary folder. No code of the deposit is executed.

    Exit status: 0 if the deposit is intact, 1 if the deposit is damaged (the command prints the first hundred
    problems), 2 if the file or folder does not exist.
    """
    try:
        with _intact(deposit) as folder:
            echo(f"{printable(deposit)}: intact: {_contents(folder)}")
    except _Damaged as damaged:
        echo(damaged, err=True, fg="red")
        raise typer.Exit(FAILED) from None


class _Damaged(UserError):
    """Error: a deposit is damaged."""


@contextlib.contextmanager
def _intact(deposit: Path) -> Iterator[Path]:
    """Verify a deposit and yield its folder; a zip is first unpacked into a temporary folder."""
    from icha.deposit.verify import DamagedDeposit, whole_deposit

    if not deposit.exists():
        raise UserError(f"{deposit}: no such file or folder; expected the folder of a deposit, or its zip")
    try:
        with whole_deposit(deposit) as folder:
            yield folder
    except DamagedDeposit as damaged:
        problems = damaged.args
        more = [f"… and {len(problems) - MOST_PROBLEMS:,} more"] if len(problems) > MOST_PROBLEMS else []
        heading = f"{printable(deposit)}: the deposit is damaged: {format_count(len(problems), 'problem')}"
        raise _Damaged("\n".join([heading, *problems[:MOST_PROBLEMS], *more])) from None


def _contents(folder: Path) -> str:
    from icha.deposit.verify import files_of

    sizes = [(folder / file).stat().st_size for file in files_of(folder)]
    return f"{format_count(len(sizes), 'file')}, {formatting.size(sum(sizes))}"


def reproduce(
    deposit: Deposit,
    only: Annotated[
        list[str] | None,
        option(
            "Compute only this run and its surface; may be repeated. RUN is study/surface/seed1/slope1/material, or "
            "`smallest` for the complete run with the least data.",
            metavar="RUN",
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        option(
            "Folder for the new results; repeat the command with the same folder to continue. Default: a temporary "
            "folder, which is removed if everything is reproduced."
        ),
    ] = None,
    cores: Cores = None,
) -> None:
    """Compute the results of a deposit again and compare every number with the published number.

    The command verifies the deposit and does not change any file. The installed ICHA computes the configuration of the
    deposit, and must have the version that made the deposit. The command lists packages that have other versions. No
    code of the deposit is executed, so a campaign with scripts of its own gets no figures. The command reports each
    variable as identical, within tolerance, or different. With `--only smallest` the command takes some minutes.

    Exit status: 0 if all variables are identical or within tolerance, 1 if a variable differs or the computation
    fails or is stopped, 2 if the deposit is damaged or missing, or cannot be computed again.
    """
    from icha.deposit.compare import compare_folders
    from icha.deposit.reproduce import (
        RerunError,
        add_surfaces,
        campaign_name,
        find_runs,
        prepare_rerun,
        results_without_scripts,
    )

    target = None if folder is None else folder.resolve()
    keep = folder is not None
    try:
        with _intact(deposit) as original:
            name = campaign_name(original)
            runs = find_runs(only or (), original)
            _introduce(deposit, original, folder)
            target = target or Path(tempfile.mkdtemp(prefix="icha-reproduce-")).resolve()
            copy = prepare_rerun(target, original)
            chosen = runs or results_without_scripts(copy)
            if chosen and not runs:
                echo("figures:    not drawn and not compared, because scripts of the deposit would run")
            status = _run(copy, [f"results/{name}/{path}" for path in chosen] or ["all"], cores)
            results = copy / "results" / name
            if not results.is_dir():
                echo("Error: nothing was computed", err=True, fg="red")
                raise typer.Exit(FAILED)
            compared = add_surfaces(runs, original) if runs else chosen or None
            comparison = compare_folders(original, results, compared)
        reproduced = _print_comparison(comparison)
        keep = keep or not reproduced
    except RerunError as refused:
        raise UserError(f"{printable(deposit)}: {refused}") from None
    finally:
        if target and not keep:
            shutil.rmtree(target)
    if status:
        echo(f"Some jobs did not run; to continue, add --folder {shorten_path(target)} to the command.", fg="yellow")
    if keep:
        echo(f"new results: {shorten_path(results)}")
    if not reproduced:
        raise typer.Exit(FAILED)


def _introduce(deposit: Path, original: Path, folder: Path | None) -> None:
    """Print the deposit, the installed program and the folder of results; warn of other versions of packages."""
    from icha.deposit.reproduce import other_versions

    echo(f"deposit:    {printable(deposit)}, {_contents(original)}")
    others = other_versions(original)
    echo(f"program:    the installed ICHA {version('icha')}; nothing in the deposit is executed")
    if others:
        echo(
            "Warning: other versions of packages than those that made the deposit, so digits may differ:\n"
            + "\n".join(map(printable, others)),
            fg="yellow",
        )
    echo(f"writes to:  {shorten_path(folder) if folder else 'a temporary folder'}")


def _run(project: Path, targets: list[str], cores: int | None) -> int:
    """Compute targets of the configuration in the folder `project`; return the exit status."""
    from icha.datasets.results import CONFIGURATION
    from icha.support.program import own_workflow

    # In a working directory inside a clone, `run` would use the workflow of the clone, not the installed workflow.
    with contextlib.chdir(own_workflow()):
        try:
            run(str(project / CONFIGURATION), targets, cores=cores, folder=project)
        except typer.Exit as end:
            return end.exit_code
    return 0


def _print_comparison(comparison) -> bool:
    """Print the comparison of deposit and new results; return whether all values are reproduced."""
    from icha.deposit.compare import DIFFERENT, IDENTICAL, TOLERANCE, format_comparison

    echo(f"\ncomparison of the deposit with the new results:\n\n{format_comparison(comparison)}\n")
    files = format_count(len(comparison.files), "file")
    if not comparison.files or comparison.verdict == DIFFERENT:
        echo("different: not everything is reproduced", fg="red")
        return False
    if comparison.verdict == IDENTICAL:
        echo(f"identical: every value in {files}", fg="green")
    else:
        echo(f"within tolerance: every value in {files} agrees within {TOLERANCE:g}", fg="green")
    return True


def upload(
    deposit: Annotated[
        Path, typer.Argument(help="Zip of a deposit, or the folder from which the zip was made.", show_default=False)
    ],
    url: Annotated[
        str, typer.Option(help="Server with Zenodo's deposit API, such as sandbox.zenodo.org for tests.")
    ] = "https://zenodo.org",
    draft: Annotated[int | None, option("Send the deposit to this draft, not to a new one.", metavar="ID")] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
) -> None:
    """Send a deposit to Zenodo as a draft, after your confirmation.

    The command verifies the deposit, prints what will be sent, and asks for confirmation. It sends the zip, README.md
    and ro-crate-metadata.json, with the title, authors and licence of the deposit. You can inspect, change and publish
    the draft on its page at Zenodo. The environment variable ZENODO_TOKEN must contain a token with the scopes
    deposit:write and deposit:actions.

    Exit status: 0 if all files were sent, 1 if not all files were sent, 2 if the deposit cannot be sent.
    """
    from icha.deposit.metadata import read_zenodo_metadata
    from icha.deposit.upload import server_address
    from icha.deposit.verify import CRATE, README

    archive = deposit.resolve().with_name(f"{deposit.resolve().name}.zip") if deposit.is_dir() else deposit
    try:
        address = server_address(url)
        token = _token(address)
        with _intact(archive) as folder:
            metadata = read_zenodo_metadata(folder)
            # Zenodo reserves a DOI of this form for one draft, and the deposit contains this DOI.
            reserved = re.fullmatch(r"10\.\d+/zenodo\.(\d+)", str(metadata.get("doi")))
            if reserved and int(reserved[1]) != draft:
                raise UserError(
                    f"the deposit has the DOI {metadata['doi']}, which is reserved for draft {reserved[1]}; use "
                    f"--draft {reserved[1]}, or make the deposit without publication.doi"
                )
            files = [archive, folder / README, folder / CRATE]
            echo(f"to: {address}, {f'draft {draft}' if draft else 'new draft'}")
            for key in ("title", "version", "license", "creators", "communities"):
                echo(f"{key}: {_summary(metadata.get(key))}")
            for path in files:
                size = path.stat().st_size
                echo(f"{printable(path.name)}: {formatting.size(size)} ({size:,} bytes)")
            if not yes and not sys.stdin.isatty():
                raise UserError("cannot ask for confirmation without a terminal; nothing was sent. Use --yes")
            if not yes and not confirm("Send the deposit?"):
                echo("Nothing was sent.")
                raise typer.Exit(FAILED)
            _send(address, token, draft, files, metadata)
    except ValueError as error:
        raise UserError(str(error)) from None


def _summary(value: object) -> str:
    """Return a value of the metadata of a deposit of unknown origin as a line of text."""
    names = [each.get("name", each.get("identifier")) if isinstance(each, dict) else each for each in value or ()]
    return printable("; ".join(map(str, names)) if isinstance(value, list) else value or "none")


def _token(address: str) -> str:
    token = os.environ.get(TOKEN, "").strip()
    if not re.fullmatch(r"[!-~]+", token):
        raise UserError(
            f"the environment variable {TOKEN} is {'not a token' if token else 'not set'}; expected a token with the "
            "scopes deposit:write and deposit:actions. Create a token on "
            f"{address}/account/settings/applications/tokens/new/"
        )
    return token


def _send(address: str, token: str, number: int | None, files: list[Path], metadata: dict) -> None:
    """Send files and metadata to a draft at Zenodo; if sending fails, print how to continue the draft."""
    from icha.deposit.upload import ZENODO, Draft, ZenodoError

    draft = None
    try:
        draft = Draft(address, token, number)
        # Metadata are sent before the files because the server reports errors in metadata at once.
        draft.describe(metadata)
        for path in files:
            confirmed = "checksum confirmed" if draft.upload(path) else "no checksum from the server"
            echo(f"{printable(path.name)}: sent, {confirmed}")
        echo(f"{draft.page} is a draft. Inspect and publish the draft on this page.")
    except (ZenodoError, OSError, KeyboardInterrupt) as error:
        with contextlib.suppress(OSError):
            echo(f"Error: {'stopped' if isinstance(error, KeyboardInterrupt) else error}", err=True, fg="red")
        if draft is not None:
            server_option = "" if address == ZENODO else f" --url {address}"
            echo(
                f"A draft remains: {draft.page}\n"
                f"To send again:   icha upload {shorten_path(files[0])}{server_option} --draft {draft.number}",
                err=True,
            )
        raise typer.Exit(FAILED) from None
