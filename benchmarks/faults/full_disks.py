"""Disks that are full from the start, on the way, and filled up by others."""

from __future__ import annotations

import contextlib
import random
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from benchmarks.faults.places import (
    REFUSED,
    WAYS,
    WENT_ON,
    Reference,
    Trial,
    ended,
    last_words,
    sentence,
)


@contextlib.contextmanager
def disk(folder: Path, size: int) -> Iterator[Callable[[str], None]]:
    """A small disk at `folder`; gives a function that mounts it anew with other options."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size},mode=755", "none", str(folder)], check=True)
    try:
        yield lambda options: subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True)
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def full_disk(reference: Reference, what: str, room: float | None, moment: float, way: str) -> Trial:
    """Run with `results`, or the whole working folder, on a disk that becomes full.

    `room` is the size of the disk, 1 being enough for everything but the deposit; None for a large one, which something
    else fills up at a fraction `moment` of the campaign's time.
    """
    place = reference.empty()
    below, whole = (
        (place.results.parent, reference.place.results.parent)
        if what == "results"
        else (place.folder, reference.place.folder)
    )
    needed = disk_use(file for file in whole.rglob("*") if "publish" not in file.parts)
    large = 4 * disk_use(whole.rglob("*")) + 2**24
    fault = "filled up by others" if room is None else "full from the start" if room == 0 else "full on the way"
    with disk(below, large if room is None else max(int(room * needed), 8192)) as mount:
        filler = below / "something.else"
        if room == 0:
            fill(filler)
        process = place.start(way)
        if room is None:
            time.sleep(moment * reference.seconds)
            fill(filler)
        status, said = place.end(process)
        wrong = [f"{line} is left running" for line in place.left_behind()]
        wrong += reference.half_written(place)
        words = "".join(sentence(said, "No space left on device").partition("No space left on device")[:2])
        if status and not words:
            wrong.append(f"not told that the disk is full: {last_words(said, 6)}")
        filler.unlink(missing_ok=True)
        mount(f"size={large}")
        wrong += reference.goes_on(place, way) if status else reference.unequal(place)
    end = REFUSED if status else WENT_ON
    return ended(place, Trial("full disk", f"{what}: {fault}", end, words[:200], tuple(wrong)))


def disk_use(files: Iterable[Path]) -> int:
    """Bytes that files take on a disk of pages."""
    return sum(-(-file.stat().st_size // 4096) * 4096 for file in files if file.is_file())


def fill(file: Path) -> None:
    """Write to a file until the disk is full."""
    with contextlib.suppress(OSError), file.open("wb", buffering=0) as stream:
        while True:
            stream.write(bytes(4096))


def full_disks(reference: Reference, chance: random.Random) -> Iterator[Trial]:
    """Disks that are full from the start, on the way, and filled up by others."""
    for what in ("results", "working folder"):
        rooms = [0.0, *(chance.uniform(0.05, 1.0) for _ in range(4)), chance.uniform(1.0, 1.5), None, None]
        for number, room in enumerate(rooms):
            yield full_disk(reference, what, room, chance.uniform(0.1, 0.6), WAYS[number % 2])
