"""Make a deposit, as a folder and as a zip: results, and all that others need to understand and reproduce the results.

The same results and the same revision of the program always give exactly the same files. A deposit contains no times
and no names of people, machines or folders, except those in the results, the configuration and the source.
"""

import json
import os
import shutil
import zipfile
from collections.abc import Iterable
from pathlib import Path

import xarray as xr

from icha.analysis.checks import read_checks, refuse_unknown_failures
from icha.configuration.campaign import Campaign
from icha.configuration.cases import campaign_sha256
from icha.datasets.stamp import read_stamp, refuse_outdated
from icha.deposit.crate import write_crate
from icha.deposit.dictionary import data_dictionary
from icha.deposit.metadata import citation_cff, zenodo_metadata
from icha.deposit.program import Source
from icha.deposit.readme import readme
from icha.deposit.verify import README, SOURCE, ZENODO, files_of, problem_with_name
from icha.planning.costs import Cost
from icha.planning.results import campaign_files, expected_stamps
from icha.support.atomic_files import sync_folder, whole_file
from icha.support.checksums import CHECKSUMS, changed_files, write_checksums

_BLOCK = 2**20
# All files in the zip have the earliest time that the format allows, so that the same files give the same zip.
_NO_TIME = (1980, 1, 1, 0, 0, 0)
# With this number in an entry of a zip, file permissions have the meaning of Unix.
_UNIX = 3


def make_deposit(
    folder: str | os.PathLike,
    archive: str | os.PathLike,
    *,
    results: str | os.PathLike,
    files: Iterable[str],
    campaign: Campaign,
    source: Source,
    cost: Cost,
) -> None:
    """Write a deposit to `folder` and a zip of the deposit to `archive`; an earlier deposit is replaced at the end.

    Parameters
    ----------
    folder, archive : paths of the deposit and of the zip. The folder in the zip has the name of `folder`.
    results : folder of results of the campaign.
    files : paths of the published files in `results`: at least config.used.yaml, checks.json and the campaign dataset.
    campaign : configuration with complete metadata (`icha.configuration.publication.missing_metadata`).
    cost : expected time and memory for computing the campaign.

    Raise ValueError if some systems refuse the name of a file, or if the failed checks are not exactly the known
    failures.
    """
    folder, archive, results = Path(folder), Path(archive), Path(results)
    files, publication = sorted(files), campaign.deposit_metadata()
    refuse_unknown_failures(read_checks(results / "checks.json"), [each.run for each in publication.known_failures])
    staging = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(staging, ignore_errors=True)
    try:
        for file in files:
            (staging / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(results / file, staging / file)
        source.export(staging / SOURCE)
        if wrong := [f"  {file!r} {why}" for file in files_of(staging) if (why := problem_with_name(file))]:
            listed = "\n".join(wrong)
            raise ValueError(f"not published, because some systems refuse these file names. Rename them:\n{listed}")
        _describe(staging, files, campaign, source.revision, cost)
        write_checksums(staging, [str(staging / path) for path in files_of(staging)], staging / CHECKSUMS)
        for path in files_of(staging):
            (staging / path).chmod(0o644)
        with whole_file(archive) as temporary:
            _write_zip(temporary, staging, folder.name)
            sync_folder(staging)
            archive.unlink(missing_ok=True)
            shutil.rmtree(folder, ignore_errors=True)
            staging.rename(folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def refuse_mixed(results: Path, campaign: Campaign) -> None:
    """Raise ValueError if results in a folder do not belong to the campaign, or have changed since jobs wrote them.

    The stamps of surfaces, runs, theories and the campaign dataset must be the expected ones, and the files must have
    the checksums in the list of the results. The message lists all files that differ.
    """
    refuse_outdated(expected_stamps(campaign, str(results)))
    dataset = results / campaign_files(campaign).dataset
    if (read_stamp(dataset) or {}).get("config_sha256") != campaign_sha256(campaign):
        raise ValueError(
            f"not published, because {dataset} was not computed with the settings of the campaign. Remove this file, "
            "and run the campaign again"
        )
    if changed := [f"  {results / file}" for file in changed_files(results)]:
        listed = "\n".join(changed)
        raise ValueError(
            "not published, because these files have changed since their jobs wrote them. Remove these files, and run "
            f"the campaign again:\n{listed}"
        )


def _describe(staging: Path, files: Iterable[str], campaign: Campaign, revision: str, cost: Cost) -> None:
    """Write CITATION.cff, metadata for Zenodo, data dictionary, README.md and crate of the deposit."""
    publication = campaign.deposit_metadata()
    texts = {
        "CITATION.cff": citation_cff(publication, revision),
        ZENODO: json.dumps(zenodo_metadata(publication), indent=1, ensure_ascii=False) + "\n",
        "data_dictionary.csv": data_dictionary(staging, files),
    }
    for name, text in texts.items():
        (staging / name).write_text(text, encoding="utf-8", newline="\n")
    sizes = {path: (staging / path).stat().st_size for path in files_of(staging)}
    checks = read_checks(staging / "checks.json")
    # The dataset may be large and the page shows little of it, so it is not loaded into memory.
    with xr.open_datatree(staging / f"dataset/{campaign.name}.nc", engine="netcdf4") as dataset:
        page = readme(campaign, revision=revision, dataset=dataset, checks=checks, sizes=sizes, cost=cost)
    (staging / README).write_text(page, encoding="utf-8", newline="\n")
    sizes[README] = (staging / README).stat().st_size
    write_crate(staging, publication, campaign=campaign.name, revision=revision, sizes=sizes)


def _write_zip(path: Path, folder: Path, name: str) -> None:
    """Write a folder to a zip as folder `name`, uncompressed, because compressed bytes depend on the zlib version."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for file in files_of(folder):
            entry = zipfile.ZipInfo(f"{name}/{file}", date_time=_NO_TIME)
            entry.create_system = _UNIX
            entry.external_attr = 0o100644 << 16
            entry.file_size = (folder / file).stat().st_size
            with (folder / file).open("rb") as content, archive.open(entry, "w") as stored:
                shutil.copyfileobj(content, stored, _BLOCK)
