"""Files are cut off, and bits flipped."""

from __future__ import annotations

import os
import random
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from pathlib import Path

from benchmarks.faults.places import (
    CAMPAIGN,
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

KINDS = {
    "surface": f"{RESULTS}/surfaces/rough/seed1.nc",
    "run": f"{RESULTS}/runs/load/rough/seed1/slope1/soft.nc",
    "boundary elements": f"{RESULTS}/references/boundary_elements/truth/rough/seed1/slope1/bare/p0.01.nc",
    "theories": f"{RESULTS}/references/rough.nc",
    "campaign dataset": f"{RESULTS}/dataset/{CAMPAIGN}.nc",
    "comparison": f"{RESULTS}/aggregated/{CAMPAIGN}.nc",
    "checks": f"{RESULTS}/checks.json",
    "figure": f"{RESULTS}/figures/fig10_model_error.png",
    "report": f"{RESULTS}/report.html",
    "configuration as used": f"{RESULTS}/config.used.yaml",
    "file of the deposit": f"{RESULTS}/publish/{CAMPAIGN}-1.0/dataset/{CAMPAIGN}.nc",
    "archive of the deposit": f"{RESULTS}/publish/{CAMPAIGN}-1.0.zip",
    "checksum record": f"{RESULTS}/checksums/runs/load/rough/seed1/slope1/soft.nc.json",
    "Snakemake's record": ".snakemake/metadata/"
    + urlsafe_b64encode(f"{RESULTS}/runs/load/rough/seed1/slope1/soft.nc".encode()).decode(),
}
DAMAGES = ("empty", "cut in half", "last byte lost", "bit flipped at the start", "in the middle", "at the end")


def flip(file: Path, place: str, bit: int = 0) -> None:
    """Flip a bit of a file at the start, in the middle or at the end."""
    content = bytearray(file.read_bytes())
    content[{"start": 0, "middle": len(content) // 2, "end": -1}[place]] ^= 1 << bit
    file.write_bytes(content)


def spoil(file: Path, damage: str, bit: int) -> None:
    """Damage a file."""
    size = file.stat().st_size
    if "start" in damage or "middle" in damage or "at the end" in damage:
        flip(file, damage.rsplit(" ", 1)[1], bit)
    else:
        os.truncate(file, {"empty": 0, "cut in half": size // 2, "last byte lost": size - 1}[damage])


def damage(reference: Reference, kind: str, how: str, bit: int, way: str) -> Trial:
    """Damage one file of a finished campaign, and run it again."""
    place = reference.copy()
    spoil(place.folder / KINDS[kind], how, bit)
    wrong = reference.goes_on(place, way)
    return ended(place, Trial("damage", kind, WENT_ON, violations=tuple(f"{how}, {way}: {each}" for each in wrong)))


def silent_damage(reference: Reference, kind: str, lost: str, way: str) -> Trial:
    """Flip a bit as a failing disk does, without a new time of change, where a job is still to read the file."""
    place = reference.copy()
    file = place.folder / KINDS[kind]
    status = file.stat()
    flip(file, "middle")
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    (place.folder / KINDS[lost]).unlink()
    failed, said = place.run(way)
    words = sentence(said, "not what was written")
    wrong = [] if failed and words else [f"not told: {last_words(said)}"]
    wrong += [
        each for each in reference.half_written(place) if not each.startswith(os.path.relpath(file, place.results))
    ]
    wrong += reference.goes_on(place, way)
    return ended(place, Trial("damage", f"{kind}, by the disk", REFUSED, words[:200], tuple(wrong)))


def damage_everything(reference: Reference, turn: int, bit: int, way: str) -> Trial:
    """Damage all kinds of files at once, each in another way; all that can be are to be found and kept."""
    place = reference.copy()
    spoilt = {}
    for number, kind in enumerate(KINDS):
        file = place.folder / KINDS[kind]
        spoil(file, DAMAGES[(turn + number) % len(DAMAGES)], bit)
        spoilt[kind] = file.read_bytes()
    wrong = reference.goes_on(place, way)
    for kind in KINDS:
        if kind in ("checksum record", "Snakemake's record", "file of the deposit"):
            continue  # not results, and a result whose folder is set aside
        file = place.folder / KINDS[kind]
        aside = file.with_name(f"{file.name}.damaged")
        if not aside.is_file() or aside.read_bytes() != spoilt[kind]:
            wrong.append(f"damaged {kind} was not kept")
    return ended(place, Trial("damage", "all of these at once", WENT_ON, violations=tuple(wrong)))


def damages(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Every kind of file, damaged in three ways by itself and in all ways together with the others."""
    for number, kind in enumerate(KINDS):
        for turn in (0, 2, 4):
            how = DAMAGES[(turn + number) % len(DAMAGES)]
            yield damage(reference, kind, how, chance.randrange(8), WAYS[(number + turn // 2) % 2])
    for turn in range(len(DAMAGES)):
        yield damage_everything(reference, turn, chance.randrange(8), WAYS[turn % 2])
    for number, (kind, lost) in enumerate(
        {"surface": "run", "run": "campaign dataset", "campaign dataset": "figure", "comparison": "report"}.items()
    ):
        yield silent_damage(reference, kind, lost, WAYS[number % 2])
