"""Published numbers that figures and tables are compared with; they live in `literature.json`, with citations."""

import json
from functools import cache
from importlib.resources import files


@cache
def _entries() -> dict:
    return json.loads(files("icha.references").joinpath("literature.json").read_text(encoding="utf-8"))


def literature(name: str) -> dict:
    """One entry of the file, with title, description, citation and DOIs, and the unit of every number.

    There are `gfmd_area`, `area_slope` and `contact_mechanics_challenge`. Lists of an entry belong together, point by
    point.

    Raises
    ------
    ValueError
        If there is no such entry.
    """
    entries = _entries()
    if name not in entries:
        raise ValueError(f"literature: no entry {name!r}; there are {', '.join(entries)}")
    return entries[name]
