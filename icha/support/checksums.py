"""Checksums of files, and the list of checksums of a folder of results, which shows damage of the disk."""

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

from icha.support.atomic_files import whole_file

# List of checksums in a folder of results, in the format of the program `sha256sum`.
CHECKSUMS = "SHA256SUMS"


class LongList(list):
    """List as a parameter of a job; Snakemake prints, records and compares its checksum instead of the list."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the SHA-256 of the list."""
        return f"sha256:{hashlib.sha256(repr(list(self)).encode()).hexdigest()}"


def sha256_of(file: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal form."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def refuse_changed(file: str | os.PathLike, sha256: str, name: str | os.PathLike | None = None) -> None:
    """Raise ValueError if a file has another checksum; otherwise results would be attributed to its old content.

    `name` is the original name of a copied file, for the message.
    """
    if sha256_of(Path(file)) != sha256:
        raise ValueError(f"{name or file} has changed since the campaign started; repeat the command")


def write_checksums(folder: str | os.PathLike, files: Iterable[str], output: str | os.PathLike) -> None:
    """Write the list of checksums of `files`, with paths relative to `folder`."""
    paths = sorted(os.path.relpath(file, folder) for file in files)
    with whole_file(output) as temporary:
        lines = (f"{sha256_of(Path(folder, path))}  {path}\n" for path in paths)
        temporary.write_text("".join(lines), encoding="utf-8")


def changed_files(folder: str | os.PathLike) -> list[str]:
    """Return the files of a folder that are missing or differ from the list of checksums in this folder."""
    changed = []
    for line in Path(folder, CHECKSUMS).read_text(encoding="utf-8").splitlines():
        sha256, _, path = line.partition("  ")
        file = Path(folder, path)
        if not file.is_file() or sha256_of(file) != sha256:
            changed.append(path)
    return changed
