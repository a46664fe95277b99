"""Verify, reproduce and upload deposits."""

import contextlib
import os
import re
import shutil
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.project import FAILED, Anyway, Cores, Large, UserError, confirmed, echo, shown
from icha.cli.run import run
from icha.support import formatting
from icha.support.formatting import format_count, printable

TOKEN = "ZENODO_TOKEN"
_MOST_PROBLEMS = 100

Deposit = Annotated[Path, typer.Argument(help="Folder of a deposit, or its zip.", show_default=False)]


def verify(deposit: Deposit, large: Large = False) -> None:
    """Verify a deposit: all its files must be there with the right checksums, and no others.

    Names that lead out of it, links, devices and zips that unpack to far more than their size are problems, too. A zip
    is unpacked into a temporary folder. Nothing of the deposit is executed.

    Exit status: 0 if it is whole, 1 if not (the first hundred problems are printed), 2 if there is no such file or
    folder.
    """
    from icha.deposit.verify import Damaged

    try:
        with _whole(deposit, large) as folder:
            echo(f"{printable(deposit)}: whole: {_size_of(folder)}")
    except Damaged as damaged:
        echo(_listed(damaged.args))
        echo(f"{printable(deposit)}: not whole: {format_count(len(damaged.args), 'problem')}", err=True, fg="red")
        raise typer.Exit(FAILED) from None


@contextlib.contextmanager
def _whole(deposit: Path, large: bool) -> Iterator[Path]:
    """Provide the folder of a deposit that is there, verified, and unpacked if it is a zip."""
    from icha.deposit.verify import whole_deposit

    if not deposit.exists():
        raise UserError(f"{deposit}: no such file or folder; needed: the folder of a deposit, or its zip")
    with whole_deposit(deposit, large=large) as folder:
        yield folder


def _size_of(folder: Path) -> str:
    from icha.deposit.verify import files_of

    files = files_of(folder)
    return (
        f"{format_count(len(files), 'file')}, {formatting.size(sum((folder / file).stat().st_size for file in files))}"
    )


def _listed(problems: tuple[str, ...]) -> str:
    more = [f"… and {len(problems) - _MOST_PROBLEMS:,} more"] if len(problems) > _MOST_PROBLEMS else []
    return "\n".join([*problems[:_MOST_PROBLEMS], *more])


def reproduce(
    deposit: Deposit,
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
    anyway: Anyway = False,
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the comparison to this file.", show_default=False)
    ] = None,
    large: Large = False,
) -> None:
    """Compute a deposit again and compare every number with it.

    The deposit is verified and only read. Its configuration is run by the ICHA that is installed, whose version and
    packages must be those of the deposit; nothing in the deposit is executed. Everything that was computed is compared,
    variable by variable: identical, within tolerance, or different. With `--only smallest` this takes minutes.

    Exit status: 0 if all is identical or within tolerance, 1 if not, or if computing fails or is stopped, 2 if the
    deposit is damaged or not there, or nothing is computed for another reason.
    """
    from icha.deposit.compare import compare_folders, write_json
    from icha.deposit.reproduce import Refused, asked_runs, campaign_name, prepare, with_surfaces
    from icha.deposit.verify import Damaged

    try:
        with _whole(deposit, large) as original:
            name = campaign_name(original)
            runs = asked_runs(only or (), original)
            _introduce(deposit, original, folder)
            place = (folder or Path(tempfile.mkdtemp(prefix="icha-reproduce-"))).resolve()
            try:
                project = prepare(place, original)
                targets = [f"results/{name}/{path}" for path in runs] or ["all"]
                status = _run(project, targets, cores, anyway)
                made = project / "results" / name
                if not made.is_dir():
                    echo("Error: nothing was computed", err=True, fg="red")
                    raise typer.Exit(FAILED)
            except BaseException:
                if folder is None:
                    shutil.rmtree(place)
                raise
            comparison = compare_folders(original, made, with_surfaces(runs, original) if runs else None)
    except Damaged as damaged:
        raise UserError(f"{printable(deposit)}: the deposit is damaged:\n{_listed(damaged.args)}") from None
    except Refused as refused:
        raise UserError(f"{printable(deposit)}: {refused}") from None
    good = _report(comparison)
    if status:
        echo(f"Not everything was computed; the same command with --folder {shown(place)} continues.", fg="yellow")
    if folder is None and good:
        shutil.rmtree(place)
    else:
        echo(f"what was computed again: {shown(made)}")
    if json:
        write_json(comparison, json)
    if not good:
        raise typer.Exit(FAILED)


def _introduce(deposit: Path, original: Path, folder: Path | None) -> None:
    """Print what the deposit is and says of itself, and which program runs; refuse other versions than those in it."""
    from icha.deposit.metadata import read_zenodo_metadata, summary_of
    from icha.deposit.reproduce import Refused, changed_files, other_versions
    from icha.deposit.verify import ZENODO

    try:
        statements = summary_of(read_zenodo_metadata(original)) if (original / ZENODO).is_file() else {}
    except ValueError as error:
        raise Refused(str(error)) from None
    echo(f"deposit:    {printable(deposit)}, {_size_of(original)}")
    echo("it says of itself, and nobody has checked it:" if statements else "it does not say whose it is")
    for name, text in statements.items():
        if text:
            echo(f"  {name + ':':<10}{printable(textwrap.shorten(text, 200, placeholder=' …'))}")
    if wrong := other_versions(original):
        raise Refused(
            "was made with other versions than those that are installed; needed: these versions, as `make environment` "
            "installs them in a clone of that version, or in a copy of the deposit's source:\n" + "\n".join(wrong)
        )
    echo(f"is run:     the ICHA that is installed, {version('icha')}; nothing in the deposit is executed")
    if changed := changed_files(original):
        echo(f"            (the deposit's source differs from it in {format_count(changed, 'file')})", fg="yellow")
    echo(f"can touch:  {shown(folder) if folder else 'a temporary folder'}")


def _run(project: Path, targets: list[str], cores: str | None, anyway: bool) -> int:
    """Run the configuration in a folder with the installed program; return the exit status."""
    from icha.datasets.results import CONFIGURATION
    from icha.support.program import own_workflow

    # From here no other workflow is found, whatever lies above the working directory.
    with contextlib.chdir(own_workflow()):
        try:
            run(str(project / CONFIGURATION), targets, cores=cores, folder=project, anyway=anyway)
        except typer.Exit as ended:
            return ended.exit_code
    return 0


def _report(comparison) -> bool:
    """Print the comparison; return whether everything is reproduced."""
    from icha.deposit.compare import DIFFERENT, IDENTICAL, TOLERANCE, table

    echo(f"\nthe deposit, and what was computed again:\n\n{table(comparison)}\n")
    files = format_count(len(comparison.files), "file")
    if not comparison.files or comparison.verdict == DIFFERENT:
        echo("different: not everything is reproduced", fg="red")
        return False
    if comparison.verdict == IDENTICAL:
        echo(f"identical: {files}, every value", fg="green")
    else:
        echo(f"within tolerance: {files}, every value to {TOLERANCE:g}", fg="green")
    return True


def upload(
    deposit: Annotated[
        Path, typer.Argument(help="A deposit's .zip, or its folder with the .zip beside it.", show_default=False)
    ],
    sandbox: Annotated[
        bool, typer.Option("--sandbox", help="Upload to sandbox.zenodo.org, for trials; it needs a token of its own.")
    ] = False,
    url: Annotated[
        str | None,
        typer.Option(help="Upload to another server with Zenodo's deposit API: https://….", show_default=False),
    ] = None,
    new_version_of: Annotated[
        int | None,
        typer.Option(metavar="ID", help="Upload as a new version of this record of yours.", show_default=False),
    ] = None,
    draft: Annotated[
        int | None,
        typer.Option(
            metavar="ID",
            help="Upload into this draft, such as one that a failed upload left; files in it are not sent again.",
            show_default=False,
        ),
    ] = None,
    publish: Annotated[
        bool, typer.Option("--publish", help="Also publish it. This cannot be undone, so you are asked again.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    large: Large = False,
) -> None:
    """Send a deposit to Zenodo as a draft, after showing what is sent where, and asking.

    The deposit is verified first. The zip is sent and, beside it, its README.md and ro-crate-metadata.json. Title,
    authors, licence and so on are those of the deposit. Without --publish it stays a draft, which you can look at,
    change and publish on its page. The environment variable ZENODO_TOKEN must hold a token with the scopes
    deposit:write and deposit:actions. Nothing is sent before you agree.

    Exit status: 0 if everything was sent, 1 if not, 2 if it cannot be sent.
    """
    from icha.deposit.metadata import read_zenodo_metadata, summary_of
    from icha.deposit.upload import SANDBOX, ZENODO, Zenodo, server_address
    from icha.deposit.verify import CRATE, README, Damaged

    if (sandbox and url) or (draft and new_version_of):
        raise UserError("--sandbox and --url, and --draft and --new-version-of, exclude each other; give one of them")
    archive = deposit.resolve().with_name(f"{deposit.resolve().name}.zip") if deposit.is_dir() else deposit
    try:
        address = server_address(url or (SANDBOX if sandbox else ZENODO))
        server = Zenodo(address, _token(address))
        with _whole(archive, large) as folder:
            metadata = read_zenodo_metadata(folder)
            files = [archive, folder / README, folder / CRATE]
            place = f"draft {draft}" if draft else f"new version of {new_version_of}" if new_version_of else "new draft"
            rows = {"to": f"{address}, {place}", **summary_of(metadata)}
            for path in files:
                size = path.stat().st_size
                rows[path.name] = f"{formatting.size(size)} ({size:,} bytes)"
            _refuse_foreign_doi(metadata, draft)
            echo("\n".join(f"{name + ':':<11}{printable(value or 'none')}" for name, value in rows.items()))
            if not yes and not sys.stdin.isatty():
                raise UserError("cannot ask for confirmation without a terminal; nothing was sent. Use --yes")
            if not yes and not confirmed("Send it?"):
                echo("Nothing was sent.")
                raise typer.Exit(FAILED)
            _send(server, files, metadata, draft, new_version_of, publish, yes)
    except Damaged as damaged:
        raise UserError(f"{archive}: the deposit is damaged; nothing was sent:\n{_listed(damaged.args)}") from None
    except ValueError as error:
        raise UserError(str(error)) from None


def _token(address: str) -> str:
    token = os.environ.get(TOKEN, "").strip()
    if not re.fullmatch(r"[!-~]+", token):
        raise UserError(
            f"{TOKEN} is {'not a token' if token else 'not set'}; needed: a token, with the scopes deposit:write and "
            f"deposit:actions, from {address}/account/settings/applications/tokens/new/, in that environment variable"
        )
    return token


def _refuse_foreign_doi(metadata: dict, draft: int | None) -> None:
    """Refuse a DOI that Zenodo has reserved for another draft, since all files of the deposit name it."""
    found = re.fullmatch(r"10\.\d+/zenodo\.(\d+)", str(metadata.get("doi")))
    if found and int(found[1]) != draft:
        raise UserError(
            f"the deposit has the DOI {metadata['doi']}, which is reserved for draft {found[1]}; needed: --draft "
            f"{found[1]}, or a deposit without publication.doi"
        )


def _send(server, files, metadata, number, new_version_of, publish, yes) -> None:
    """Send files and metadata to a draft; if that fails, print how to continue."""
    from icha.deposit.upload import ZENODO, ZenodoError, md5_of

    draft = None
    try:
        if number:
            draft = server.draft(str(number))
        else:
            draft = server.new_version(str(new_version_of)) if new_version_of else server.create()
        echo(f"draft:     {draft.page}")
        sums = {path.name: md5_of(path) for path in files}
        there = {name for name, (_, md5) in draft.files.items() if md5 == sums.get(name)}
        for name in set(draft.files) - there:
            if name in sums or new_version_of:
                server.remove(draft, name)
            else:
                echo(f"{name}: another file of the draft, which stays there")
        # Before the files, since mistakes in it are known at once.
        server.describe(draft, metadata)
        for path in files:
            if path.name in there:
                echo(f"{path.name}: is there already")
                continue
            arrived = server.upload(draft, path, sums[path.name])
            echo(f"{path.name}: sent, {'its checksum is right' if arrived else 'the server gives no checksum'}")
        if draft.doi:
            echo(f"DOI:       {draft.doi} (reserved)")
        if publish and (yes or confirmed("Publish it? What is published cannot be deleted.")):
            page, doi = server.publish(draft)
            echo(f"published: {page}\nDOI:       {doi}")
        else:
            echo("It is a draft. Look at it, and publish it, on its page.")
    except (ZenodoError, OSError, KeyboardInterrupt) as error:
        with contextlib.suppress(OSError):
            echo(f"Error: {'stopped' if isinstance(error, KeyboardInterrupt) else error}", err=True, fg="red")
        if draft is not None:
            option = "" if server.address == ZENODO else f" --url {server.address}"
            echo(
                f"A draft is left: {draft.page}\n"
                f"To continue with it:   icha upload {shown(files[0])}{option} --draft {draft.number}",
                err=True,
            )
        raise typer.Exit(FAILED) from None
