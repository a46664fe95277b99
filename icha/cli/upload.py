"""Send a deposit to Zenodo, after having said what is sent, and asked."""

import contextlib
import os
import re
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from icha.cli.deposits import agree, flaws_of, listed
from icha.cli.project import FAILED, Large, Mistake, confirmed, say, shown
from icha.support import in_words
from icha.support.in_words import printable

TOKEN = "ZENODO_TOKEN"


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
        str | None,
        typer.Option(metavar="ID", help="Upload as a new version of this record of yours.", show_default=False),
    ] = None,
    draft: Annotated[
        str | None,
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
    from icha.deposit.zenodo import SANDBOX, ZENODO, server_address

    if sandbox and url:
        raise Mistake("--sandbox and --url name two servers; allowed: only one of them")
    if draft and new_version_of:
        raise Mistake("--draft and --new-version-of name two places; allowed: only one of them")
    try:
        address = server_address(url or (SANDBOX if sandbox else ZENODO))
    except ValueError as error:
        raise Mistake(f"--url: {error}") from None
    draft, new_version_of = _number("--draft", draft), _number("--new-version-of", new_version_of)
    token = _token(address)
    archive = _archive(deposit, large)
    with tempfile.TemporaryDirectory() as folder:
        files, metadata = _contents(archive, Path(folder))
        _refuse_foreign_doi(metadata, draft)
        place = f"draft {draft}" if draft else f"a new version of {new_version_of}" if new_version_of else "a new draft"
        say(_summary(metadata, files, f"{address}, {place}"))
        agree("Send it?", yes=yes, done="sent")
        _send(archive, files, metadata, address, token, draft, new_version_of, publish, yes)


def _number(option: str, text: str | None) -> str | None:
    """The number of a record; taken from its DOI or its page's address, too."""
    if text is None:
        return None
    found = re.fullmatch(r"(?:\S*[./])?(\d+)/?", text)
    if not found:
        raise Mistake(f"{option} {text!r}: is not the number of a record; allowed: a number such as 1234567")
    return found[1]


def _token(address: str) -> str:
    token = os.environ.get(TOKEN, "").strip()
    if not token:
        raise Mistake(
            f"{TOKEN} is not set; needed: a token, with the scopes deposit:write and deposit:actions, from "
            f"{address}/account/settings/applications/tokens/new/, in that environment variable"
        )
    if not re.fullmatch(r"[!-~]+", token):
        raise Mistake(f"{TOKEN} is not a token: it contains characters that no token has")
    return token


def _archive(deposit: Path, large: bool) -> Path:
    """The zip of a deposit, verified."""
    from icha.deposit.deposit_files import CHECKSUMS, read_file, whole_deposit

    archive = deposit
    if deposit.is_dir():
        archive = deposit.resolve().with_name(f"{deposit.resolve().name}.zip")
        if not archive.is_file():
            raise Mistake(f"{deposit}: there is no {archive.name} beside it; `icha run … publish` makes both")
    wrong = flaws_of(archive, large=large)
    if not wrong and deposit.is_dir():
        with whole_deposit(archive) as packed, whole_deposit(deposit) as folder:
            if read_file(packed, CHECKSUMS) != read_file(folder, CHECKSUMS):
                wrong = ["its zip and its folder have different checksums"]
    if wrong:
        raise Mistake(f"{deposit}: the deposit is damaged, and nothing is sent:\n{listed(wrong)}")
    return archive


def _contents(archive: Path, folder: Path) -> tuple[list[Path], dict]:
    """The files that are sent, and the metadata for Zenodo."""
    from icha.deposit.deposit_files import CRATE, README, ZENODO, copy_file, whole_deposit
    from icha.deposit.statement import metadata_of

    beside = README, CRATE
    with whole_deposit(archive) as found:
        for name in (*beside, ZENODO):
            if name not in found.sizes:
                raise Mistake(f"{archive}: has no {name}, as a deposit has")
        for name in beside:
            copy_file(found, name, folder / name)
        try:
            return [archive, *(folder / name for name in beside)], metadata_of(found)
        except ValueError as error:
            raise Mistake(f"{archive}: {error}") from None


def _refuse_foreign_doi(metadata: dict, draft: str | None) -> None:
    """A DOI that Zenodo has reserved belongs to one draft, and the deposit says it everywhere."""
    found = re.fullmatch(r"10\.\d+/zenodo\.(\d+)", metadata.get("doi") or "")
    if found and found[1] != draft:
        raise Mistake(
            f"the deposit has the DOI {metadata['doi']}, which is reserved for draft {found[1]}; needed: --draft "
            f"{found[1]}, or a deposit without publication.doi"
        )


def _summary(metadata: dict, files: list[Path], where: str) -> str:
    from icha.deposit.statement import names, statement

    sizes = [(path, path.stat().st_size) for path in files]
    rows = [
        ("to", where),
        *statement(metadata).items(),
        ("community", names(metadata, "communities", "identifier")),
        *(("file", f"{path.name}, {in_words.size(size)} ({size:,} bytes)") for path, size in sizes),
    ]
    return "\n".join(f"{name + ':':<11}{printable(value or 'none')}" for name, value in rows)


def _send(archive, files, metadata, address, token, number, new_version_of, publish, yes) -> None:
    from icha.deposit.zenodo import ZENODO, Zenodo, ZenodoError, md5_of

    server, draft = Zenodo(address, token), None
    try:
        if number:
            draft = server.draft(number)
        else:
            draft = server.new_version(new_version_of) if new_version_of else server.create()
        say(f"draft:     {draft.page}")
        sums = {path.name: md5_of(path) for path in files}
        there = {file.name for file in draft.files if file.md5 == sums.get(file.name)}
        others = []
        for file in draft.files:
            if file.name in there:
                continue
            if file.name in sums or new_version_of:
                server.remove(draft, file)
            else:
                others.append(file.name)
        # Before the files, for what is wrong with it is known at once.
        server.describe(draft, metadata)
        for path in files:
            if path.name in there:
                say(f"{path.name}: is there already")
                continue
            arrived = server.upload(draft, path, sums[path.name])
            checked = "its checksum is right" if arrived else "the server gives no checksum"
            say(f"{path.name}: sent, {checked}")
        if others:
            say(f"The draft also has other files, which stay there: {', '.join(others)}")
        if draft.doi:
            say(f"DOI:       {draft.doi} (reserved)")
        if publish and (yes or confirmed("Publish it? What is published cannot be deleted.")):
            published = server.publish(draft)
            say(f"published: {published.page}\nDOI:       {published.doi}")
        else:
            say("It is a draft. Look at it, and publish it, on its page.")
    except (ZenodoError, OSError, KeyboardInterrupt) as error:
        with contextlib.suppress(OSError):
            say(f"Error: {'stopped' if isinstance(error, KeyboardInterrupt) else error}", err=True, fg="red")
        if draft is not None:
            server_option = "" if address == ZENODO else f" --url {address}"
            say(
                f"A draft is left: {draft.page}\nTo continue with it:   icha upload {shown(archive)}"
                f"{server_option} --draft {draft.number}",
                err=True,
            )
        raise typer.Exit(FAILED) from None
