"""Published numbers that figures and tables are compared with; they live in `literature.json`, with citations."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files


@cache
def _entries() -> dict:
    return json.loads(files("icha.reference").joinpath("literature.json").read_text(encoding="utf-8"))


def literature(name: str) -> dict:
    """One entry of the file: `gfmd_area` or `contact_mechanics_challenge`, with title, citation and DOIs.

    Raises
    ------
    ValueError
        If there is no such entry.
    """
    entries = _entries()
    if name not in entries:
        raise ValueError(f"literature: no entry {name!r}; there are {', '.join(entries)}")
    return entries[name]
