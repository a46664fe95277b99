"""What a deposit says of itself, in the metadata that a repository shows; nobody has checked it."""

import json

from icha.deposit.deposit_files import ZENODO, read_file
from icha.deposit.strangers_files import Found


def metadata_of(deposit: Found) -> dict:
    """The metadata of a deposit that is whole.

    Raises
    ------
    ValueError
        If they are not what they should be: text and lists of mappings by their names.
    """
    try:
        metadata = json.loads(read_file(deposit, ZENODO))
        if not isinstance(metadata, dict):
            raise ValueError("not a mapping")
        for name in ("title", "version", "license", "doi", "description"):
            if not isinstance(metadata.get(name, ""), str):
                raise ValueError(f"{name} is no text")
        for name in ("creators", "communities"):
            entries = metadata.get(name, [])
            if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
                raise ValueError(f"{name} is no list of mappings")
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{ZENODO}: {str(error) or 'is nested too deeply'}") from None
    return metadata


def statement(metadata: dict) -> dict[str, str]:
    """Title, version, authors and licence, as lines of text."""
    return {
        "title": metadata.get("title", ""),
        "version": metadata.get("version", ""),
        "authors": names(metadata, "creators", "name"),
        "licence": metadata.get("license", ""),
    }


def names(metadata: dict, section: str, key: str) -> str:
    """The entries of a list, each by one of its keys."""
    return "; ".join(str(entry.get(key, "")) for entry in metadata.get(section, ()))
