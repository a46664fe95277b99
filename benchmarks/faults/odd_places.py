"""Names that shells and Python take for something else, paths that are too long, obstacles."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

from benchmarks.faults.places import (
    REFUSED,
    RESULTS,
    WAYS,
    WENT_ON,
    Reference,
    Trial,
    ended,
    last_words,
    sentence,
)


def odd_name(reference: Reference, name: str, way: str) -> Trial:
    """Run in a folder, and from a clone, with a name that a shell would take for something else."""
    folder = reference.scratch / f"{name}{next(reference.numbers)}"
    place = reference.empty(folder)
    place.project = shutil.copytree(reference.project, folder.with_name(f"{folder.name} clone"), symlinks=True)
    wrong = tuple(reference.goes_on(place, way))
    shutil.rmtree(place.project)
    return ended(place, Trial("odd place", "names of folders", WENT_ON, violations=wrong))


def backslash(reference: Reference, way: str) -> Trial:
    """Run in a folder with a backslash in its name, in which netCDF's library finds no file."""
    place = reference.empty(reference.scratch / f"back\\slash{next(reference.numbers)}")
    status, said = place.run(way)
    words = sentence(said, "has a backslash")
    wrong = [] if status and words and "Traceback" not in said else [f"not told: {last_words(said)}"]
    wrong += [f"{file.name} was computed" for file in place.results.rglob("*.nc")]
    return ended(place, Trial("odd place", "a backslash in its name", REFUSED, words[:200], tuple(wrong)))


def odd_modules(reference: Reference, way: str) -> Trial:
    """Run in a folder whose files have the names of modules."""
    place = reference.empty()
    for name in ("icha", "json", "numpy", "socket", "snakemake"):
        (place.folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')\n")
    return ended(place, Trial("odd place", "modules in it", WENT_ON, violations=tuple(reference.goes_on(place, way))))


def long_temporary(reference: Reference, way: str) -> Trial:
    """Run with a folder for temporary files whose path is too long for a socket."""
    place = reference.empty()
    folder = reference.scratch / ("temporary" * 12)
    folder.mkdir(exist_ok=True)
    status, said = place.run(way, TMPDIR=str(folder))
    wrong = [f"the call failed: {last_words(said)}"] if status else []
    wrong += reference.unequal(place)
    return ended(place, Trial("odd place", "long path of temporary files", WENT_ON, violations=tuple(wrong)))


OBSTACLES = {
    "results are a file": RESULTS,
    "results are a link to nothing": RESULTS,
    "all results are a link to nothing": "results",
    "Snakemake's records are a file": ".snakemake",
}


def obstacle(reference: Reference, what: str) -> Trial:
    """Run where something else is in the place of a folder."""
    place = reference.empty()
    file = place.folder / OBSTACLES[what]
    file.parent.mkdir(parents=True, exist_ok=True)
    if "link" in what:
        file.symlink_to("nowhere")
    else:
        file.write_text("something else")
    status, said = place.run("icha run")
    words = sentence(said, "which is not there", "and no folder")
    wrong = [] if status and words and "Traceback" not in said else [f"not told: {last_words(said)}"]
    file.unlink()
    wrong += reference.goes_on(place, "icha run")
    return ended(place, Trial("odd place", what, REFUSED, words[:200], tuple(wrong)))


def odd_places(reference: Reference) -> Iterator[Trial]:
    """Names that shells and Python take for something else, paths that are too long, obstacles."""
    names = ("a space", "it's", 'a "quote"', "R&D", "a;b", "(copy", "$HOME", "a*b", "both' of \"them & ($*;")
    for number, name in enumerate(names):
        yield odd_name(reference, name, WAYS[number % 2])
    for way in WAYS:
        yield backslash(reference, way)
        yield odd_modules(reference, way)
        yield long_temporary(reference, way)
    for what in OBSTACLES:
        yield obstacle(reference, what)
