"""Fetch a deposit from a repository, verify its checksums and read its campaign dataset: `icha.fetch_deposit`."""

import os
import re
from pathlib import Path

import xarray as xr

from icha.deposit.verify import DamagedDeposit, whole_deposit
from icha.support.input_files import refuse_traps

_DOI = re.compile(r"(?:https?://(?:dx\.)?doi\.org/|doi:)?(10\.\d{4,9}/\S+)", re.IGNORECASE)


def fetch_deposit(source: str | os.PathLike, cache: str | os.PathLike | None = None) -> xr.DataTree:
    """Fetch a deposit, verify its checksums, and return its campaign dataset.

    A downloaded zip stays in the cache, so another call needs no network. No program in the deposit is executed.

    Parameters
    ----------
    source : DOI of a record with the zip of a deposit (`10.5281/zenodo.…`), web address of the zip, or path of the zip
        or the folder.
    cache : folder of downloaded files. Default: the folder `icha` in the user's cache.

    Returns
    -------
    The campaign dataset in memory, with one node for each study.

    Raises
    ------
    ValueError
        If the record has no zip or several ones, or if the deposit is damaged or has no campaign dataset.
    OSError
        If the file does not exist or cannot be downloaded.
    """
    file = _download(str(source), cache) or Path(source)
    if not file.exists():
        raise FileNotFoundError(
            f"{file}: no such file or folder; expected a DOI, a web address, or a path of a deposit"
        )
    try:
        with whole_deposit(file) as folder:
            datasets = sorted(folder.glob("dataset/*.nc"))
            if len(datasets) != 1:
                raise ValueError(f"{source}: has {len(datasets)} files dataset/*.nc; expected one campaign dataset")
            refuse_traps(datasets[0])
            with xr.open_datatree(datasets[0]) as tree:
                return tree.load()
    except DamagedDeposit as damaged:
        more = f" and {len(damaged.args) - 1} more problems" if len(damaged.args) > 1 else ""
        raise ValueError(
            f"{source}: the deposit is damaged: {damaged.args[0]}{more}. Remove {file} if it is a download"
        ) from None


def _download(source: str, cache: str | os.PathLike | None) -> Path | None:
    """Return the downloaded zip for a DOI or a web address; None for a path."""
    doi = _DOI.fullmatch(source)
    if not doi and not source.startswith(("http://", "https://")):
        return None
    import pooch  # imported here because reading a local deposit does not need it

    folder = pooch.os_cache("icha") if cache is None else cache
    if not doi:
        return Path(pooch.retrieve(source, known_hash=None, path=folder))
    record = pooch.create(Path(folder, re.sub(r"\W", "_", doi[1])), f"doi:{doi[1]}/")
    record.load_registry_from_doi()  # names of all files of the record, with their checksums
    archives = [name for name in record.registry if name.endswith(".zip")]
    if len(archives) != 1:
        raise ValueError(f"{source}: has {len(archives)} zips; expected a record with one zip, that of a deposit")
    return Path(record.fetch(archives[0]))
