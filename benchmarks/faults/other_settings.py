"""Results of other settings, by jobs that outlive their Snakemake, and restored from a backup."""

from __future__ import annotations

import itertools
import random
import shutil
import time
from collections.abc import Iterator

from benchmarks.faults.damages import KINDS
from benchmarks.faults.places import (
    REFUSED,
    WAYS,
    WENT_ON,
    Place,
    Reference,
    Trial,
    ended,
    kill_process,
    last_words,
    sentence,
)

# For what the reference has 25 MPa.
OTHER = "materials={bare: {contact_modulus: 20 MPa}, soft: {contact_modulus: 20 MPa}}"


def orphan(reference: Reference, moment: float) -> Trial:
    """Kill Snakemake while it computes with other settings, and run with the reference's at once."""
    place = reference.empty()
    process = place.start("snakemake", "--config", OTHER)
    time.sleep(moment)
    kill_process(process.pid)
    wrong = reference.goes_on(place)
    place.end(process)
    wrong += [f"{line} is left running" for line in place.left_behind()]
    wrong += reference.unequal(place)
    return ended(place, Trial("other settings", "killed at them", WENT_ON, violations=tuple(wrong)))


def restored(reference: Reference, others: Place, what: str, way: str) -> Trial:
    """Put results of other settings in the place of the reference's, whole or one run, with or without records."""
    place = reference.copy()
    if what == "all restored":
        shutil.rmtree(place.results)
        shutil.copytree(others.results, place.results)
    elif what == "all restored, no records":
        shutil.rmtree(place.folder)
        shutil.copytree(others.folder, place.folder)
        shutil.rmtree(place.folder / ".snakemake")
    else:
        run = KINDS["run"]
        record = KINDS["checksum record"]
        for path in (run, record, *([KINDS["Snakemake's record"]] if "all its records" in what else [])):
            shutil.copy2(others.folder / path, place.folder / path)
    if "no records" in what:
        # A deposit needs records of how all was made. This is said, and how to have them.
        status, said = place.run(way)
        wrong = [] if status and NO_RECORD in said else [f"it did not say what to do: {last_words(said)}"]
        targets, place.targets = place.targets, ("all",)
        status, _ = place.run(way, *(["--"] if way == "icha run" else []), "--touch", "--forceall")
        wrong += ["records could not be made"] if status else []
        place.targets = targets
        wrong += reference.goes_on(place, way)
        return ended(place, Trial("other settings", what, REFUSED, sentence(said, NO_RECORD), tuple(wrong)))
    wrong = reference.goes_on(place, way)
    return ended(place, Trial("other settings", what, WENT_ON, violations=tuple(wrong)))


NO_RECORD = "there is no record of how it was made"
RESTORED = ("all restored", "all restored, no records", "one run restored", "one run restored with all its records")


def other_settings(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Results of other settings, by jobs that outlive their Snakemake, and restored from a backup."""
    for number in range(8):
        yield orphan(reference, chance.uniform(0.2, 0.7) * reference.seconds * (number > 0) + 0.1)
    others = reference.empty()
    others.run("snakemake", "--config", OTHER)
    for what, way in itertools.product(RESTORED, WAYS):
        yield restored(reference, others, what, way)
    others.remove()
