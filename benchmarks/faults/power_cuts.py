"""The power is cut: what was not forced to the disk by then is lost."""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import signal
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.faults.places import (
    LONGEST,
    WAYS,
    WENT_ON,
    Reference,
    Trial,
    ended,
)

# ext4 as it is hardest for programs: names may be on the disk before the data that they stand for.
HARDEST = "loop,noauto_da_alloc,data=writeback"
# EXT4_IOC_SHUTDOWN with EXT4_GOING_FLAGS_NOLOGFLUSH (Linux, fs/ext4/ext4.h): from now on nothing gets to the disk.
_SHUTDOWN, _WITHOUT_FLUSH = 0x8004587D, struct.pack("I", 2)


@contextlib.contextmanager
def power(folder: Path, image: Path) -> Iterator[tuple[Callable[[], None], Callable[[], None]]]:
    """A disk of its own at `folder`; gives functions that cut its power, and mount it again."""

    def mount():
        subprocess.run(["mount", "-o", HARDEST, str(image), str(folder)], check=True)

    def cut():
        top = os.open(folder, os.O_RDONLY)
        fcntl.ioctl(top, _SHUTDOWN, _WITHOUT_FLUSH)
        os.close(top)

    with image.open("wb") as file:
        file.truncate(2**28)
    subprocess.run(["mkfs.ext4", "-q", "-F", str(image)], check=True)
    folder.mkdir(parents=True, exist_ok=True)
    mount()
    try:
        yield cut, mount
    finally:
        unmount(folder)
        image.unlink()


def unmount(folder: Path) -> None:
    """Unmount a disk, once what was killed has let go of it."""
    until = time.monotonic() + LONGEST
    while subprocess.run(["umount", str(folder)], stderr=subprocess.DEVNULL).returncode:
        if time.monotonic() > until:
            raise SystemExit(f"{folder} cannot be unmounted")
        time.sleep(0.1)


def power_cut(reference: Reference, moment: float, way: str) -> Trial:
    """Run on a disk whose power is cut after `moment` seconds: what was not forced to it by then is lost."""
    place = reference.empty()
    with power(place.folder, place.folder.with_suffix(".disk")) as (cut, mount):
        process = place.start(way)
        time.sleep(moment)
        cut()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        place.end(process)
        wrong = [f"{line} is left running" for line in place.left_behind()]
        unmount(place.folder)
        mount()
        wrong += reference.half_written(place)
        wrong += reference.goes_on(place, way)
    return ended(place, Trial("power cut", "the disk of the working folder", WENT_ON, violations=tuple(wrong)))


def power_cuts(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Power cuts at random moments."""
    for number in range(trials):
        yield power_cut(reference, chance.uniform(0.1, 0.95) * reference.seconds, WAYS[number % 2])
