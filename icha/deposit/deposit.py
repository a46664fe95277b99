"""A deposit: results with all that others need to understand, trust and compute them again, as a folder and a zip.

The same results of the same revision give the same bytes: no times, no names of people, machines or folders but those
that the results, the configuration and the source themselves have.
"""

import json
import os
import shutil
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from icha.analysis.checks import read_checks, refuse_unknown_failures
from icha.configuration.campaign import Campaign
from icha.configuration.publication import Publication
from icha.datasets.files import read_campaign
from icha.deposit.citation import citation_cff, datacite_metadata, zenodo_metadata
from icha.deposit.crate import Job, write_crate
from icha.deposit.deposit_files import CHECKSUMS, CRATE, README, SOURCE, ZENODO, files_of
from icha.deposit.dictionary import data_dictionary, dictionary_csv
from icha.deposit.licences import known_licence, licence_page
from icha.deposit.readme import readme
from icha.deposit.source import Source
from icha.deposit.strangers_files import flaw_of_name
from icha.planning.costs import Cost
from icha.support.atomic_files import sync_folder, while_owned, whole_file
from icha.support.checksums import is_whole, sha256_of

_BLOCK = 2**20
# The earliest time that a zip can hold.
_NO_TIME = (1980, 1, 1, 0, 0, 0)


def make_deposit(
    folder: str | os.PathLike,
    archive: str | os.PathLike,
    *,
    results: str | os.PathLike,
    files: Iterable[str],
    publication: Publication,
    campaign: Campaign,
    source: Source,
    jobs: Sequence[Job],
    cost: Cost,
) -> None:
    """Write a deposit to `folder` and, as a zip, to `archive`, in the place of what is there; whole, or not at all.

    Parameters
    ----------
    folder, archive : where it goes. Its name is that of the folder within the archive.
    results : the campaign's folder of results.
    files : what of it is published, by paths from there: at least config.used.yaml, checks.json and the campaign
        dataset.
    publication : what the deposit says of itself, with version, date, authors, title, summary and licence.
    campaign : what was asked for.
    source : the source of the program.
    jobs : those that made the results.
    cost : what computing the campaign is expected to take.

    Raises
    ------
    ValueError
        If a file is not what its job wrote or has a name that not every system can have, if a check failed that is not
        among the known failures, or if one of these is none.
    """
    folder, archive, results = Path(folder), Path(archive), Path(results)
    files = sorted(files)
    _refuse_names(files)
    _refuse_unknown_failures(results, publication)
    _refuse_changed(results, files)
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        for file in files:
            _copy(results / file, part / file)
        source.export(part / SOURCE)
        _describe(part, files, publication, campaign, source.revision, cost)
        checksums = {path: sha256_of(part / path) for path in files_of(part)}
        write_crate(part, publication, jobs, campaign=campaign.name, revision=source.revision, checksums=checksums)
        (part / CRATE).chmod(0o644)
        checksums[CRATE] = sha256_of(part / CRATE)
        _write(part / CHECKSUMS, "".join(f"{checksums[path]}  {path}\n" for path in sorted(checksums)))
        with whole_file(archive) as temporary:
            _write_zip(temporary, part, folder.name)
            sync_folder(part)
            with while_owned():
                # What was here before goes at once, and its checksums with it.
                archive.unlink(missing_ok=True)
                _remove(folder)
                part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _refuse_names(files: Iterable[str]) -> None:
    """Refuse names that `verify` would: of what the configuration names, for all others are ours."""
    if wrong := [f"  {file!r} {flaw}" for file in files if (flaw := flaw_of_name(file))]:
        raise ValueError("not published, for these names; needed: others, for the same files:\n" + "\n".join(wrong))


def _refuse_unknown_failures(results: Path, publication: Publication) -> None:
    try:
        refuse_unknown_failures(read_checks(results / "checks.json"), [each.run for each in publication.known_failures])
    except ValueError as error:
        raise ValueError(
            "not published, for readers would not know of failures; needed: results without them, or each run that "
            f"fails, and no other, among publication.known_failures with its reason:\n{error}"
        ) from None


def _refuse_changed(results: Path, files: Iterable[str]) -> None:
    """Refuse results that are not what their jobs wrote, as far as that is recorded; every byte is looked at."""
    changed = [file for file in files if not is_whole(results, file, thorough=True)]
    if changed:
        raise ValueError(
            "not published, for these files of the results are not what was written; needed: remove them, and run the "
            "campaign again:\n" + "\n".join(f"  {results / file}" for file in changed)
        )


def _describe(part: Path, files: Sequence[str], publication: Publication, campaign: Campaign, revision, cost) -> None:
    """Write all that says what the deposit is."""
    licence = known_licence(publication.license)
    dictionary = data_dictionary(part, files)
    _write(part / "LICENSE.txt", licence_page(licence, source=SOURCE))
    _write(part / "CITATION.cff", citation_cff(publication, revision))
    _write(part / ZENODO, _json(zenodo_metadata(publication)))
    _write(part / "datacite.json", _json(datacite_metadata(publication)))
    _write(part / "data_dictionary.csv", dictionary_csv(dictionary))
    error = part / "aggregated/model_error.nc"
    # The dataset may be large, and little of it is told.
    with xr.open_datatree(part / f"dataset/{campaign.name}.nc", engine="netcdf4") as dataset:
        page = readme(
            publication,
            campaign=campaign,
            licence=licence,
            revision=revision,
            dataset=dataset,
            checks=read_checks(part / "checks.json"),
            model_error=read_campaign(error) if error.is_file() else None,
            dictionary=dictionary,
            sizes={path: (part / path).stat().st_size for path in files_of(part)},
            cost=cost,
        )
    _write(part / README, page)


def _json(content) -> str:
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")
    path.chmod(0o644)


def _copy(file: Path, copy: Path) -> None:
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(file, copy)
    copy.chmod(0o644)


def _remove(folder: Path) -> None:
    """Remove a folder that is there, so that at no moment a part of it is under its name."""
    if folder.is_dir():
        old = folder.with_name(f".{folder.name}.old")
        shutil.rmtree(old, ignore_errors=True)
        folder.rename(old)
        shutil.rmtree(old)


def _write_zip(path: Path, folder: Path, name: str) -> None:
    """Write all files of a folder to a zip, in a folder of the given name. They are stored: nothing depends on zlib."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for file in files_of(folder):
            status = (folder / file).stat()
            entry = zipfile.ZipInfo(f"{name}/{file}", date_time=_NO_TIME)
            entry.create_system = 3  # Unix, of which the mode is
            entry.external_attr = (0o100000 | (0o755 if status.st_mode & 0o100 else 0o644)) << 16
            entry.file_size = status.st_size
            with (folder / file).open("rb") as content, archive.open(entry, "w") as stored:
                shutil.copyfileobj(content, stored, _BLOCK)
