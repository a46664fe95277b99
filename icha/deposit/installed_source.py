"""The source of the program as it was installed from a wheel, whose own record has the checksum of every file."""

import hashlib
import os
import shutil
from base64 import urlsafe_b64decode
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path

from icha.support.checksums import sha256_of
from icha.support.program import INSTALLED

# Folders of the wheel: the package, the workflow.
_FOLDERS = ("icha", INSTALLED)
_MOST_NAMES = 20


@dataclass(frozen=True)
class InstalledSource:
    """The files of an installed version, by their paths in the repository that it was built from."""

    revision: str
    files: dict[str, Path]

    def export(self, folder: Path) -> None:
        """Write all files to a new folder."""
        for name, file in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, folder / name)
            (folder / name).chmod(0o644)


def installed_source(workflow: str | os.PathLike) -> InstalledSource:
    """The source of the program that was installed with a workflow.

    Its revision is the version, and the checksum of a list of all its files, as `sha256sum` would print it.

    Parameters
    ----------
    workflow : the folder of the workflow, beside the package.

    Raises
    ------
    ValueError
        If a file is not what was installed, or if there are others; the message lists them and says what to do.
    """
    place = Path(workflow).resolve().parent
    installed = next(iter(distributions(name="icha", path=[str(place)])), None)
    if installed is None:
        raise ValueError(
            f"{place}: no distribution `icha` is installed here, so nobody could tell which program made the data; "
            "needed: pip install 'icha[workflow]'"
        )
    recorded = {
        str(file): urlsafe_b64decode(f"{file.hash.value}=").hex()
        for file in installed.files or ()
        if file.parts[0] in _FOLDERS and file.hash and file.hash.mode == "sha256" and file.suffix != ".pyc"
    }
    wrong = [
        *(f"changed: {name}" for name, sha256 in recorded.items() if _sha256(place / name) != sha256),
        *(f"not of the installed version: {name}" for name in _there(place) if name not in recorded),
    ]
    if wrong:
        more = [f"  and {len(wrong) - _MOST_NAMES} more"] if len(wrong) > _MOST_NAMES else []
        raise ValueError(
            f"{place}: differs from icha {installed.version}, so the deposit would not hold the program that made the "
            "data; needed: `pip install --force-reinstall icha`, or a clone of the repository for changes of the "
            "program:\n" + "\n".join([*(f"  {name}" for name in sorted(wrong)[:_MOST_NAMES]), *more])
        )
    files = {name.removeprefix(f"{INSTALLED}/"): place / name for name in sorted(recorded)}
    listed = "".join(f"{recorded[name]}  {name}\n" for name in sorted(recorded))
    return InstalledSource(f"icha-{installed.version}-{hashlib.sha256(listed.encode()).hexdigest()}", files)


def _sha256(file: Path) -> str | None:
    return sha256_of(file) if file.is_file() else None


def _there(place: Path) -> Iterator[str]:
    """Files that the program may use, but for Python's own."""
    for folder in _FOLDERS:
        for file in (place / folder).rglob("*"):
            if file.is_file() and "__pycache__" not in file.parts:
                yield file.relative_to(place).as_posix()
