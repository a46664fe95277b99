"""Results, or the whole working folder, that cannot be written to, on a disk or by permissions."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
from collections.abc import Iterator

from benchmarks.faults.damages import flip
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

# The right to write everywhere, which root has, is taken away.
WITHOUT_RIGHTS = ("setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner", "--inh-caps=-all")


def read_only(reference: Reference, what: str, state: str, way: str) -> Trial:
    """Run where nothing can be written: on a disk, or by permissions; with everything there, or something missing."""
    by_permission = what.startswith("permissions")
    with contextlib.ExitStack() as stack:
        place = reference.copy()
        folder = place.folder if "working" in what else place.results.parent
        missing = place.results / "figures/fig10_model_error.png"
        damaged = place.results / "surfaces/rough/seed1.nc"
        if state == "a figure is missing":
            missing.unlink()
        elif state == "a surface is damaged":
            flip(damaged, "middle")
        if by_permission:
            folders = [folder, *(each for each in folder.rglob("*") if each.is_dir())]
            for each in folders:
                each.chmod(0o555)
        else:
            subprocess.run(["mount", "--bind", str(folder), str(folder)], check=True)
            stack.callback(subprocess.run, ["umount", "--lazy", str(folder)], check=True)
            subprocess.run(["mount", "-o", "remount,bind,ro", str(folder)], check=True)
        before = place.times()
        status, said = place.run(way, before=WITHOUT_RIGHTS if by_permission and os.getuid() == 0 else ())
        wrong = [f"{path} was computed" for path, time in place.times().items() if before.get(path) != time]
        words = sentence(said, "cannot be written to", "cannot be set aside")
        if state == "everything is there" and not status:
            end = WENT_ON
        else:
            end = REFUSED
            if not status:
                wrong.append("it did as if it had written")
            if not words:
                wrong.append(f"not told that it is read-only: {last_words(said, 6)}")
            if "Traceback" in said:
                wrong.append(f"a traceback: {last_words(said)}")
        if by_permission:
            for each in folders:
                each.chmod(0o755)
        else:
            subprocess.run(["mount", "-o", "remount,bind,rw", str(folder)], check=True)
        wrong += reference.goes_on(place, way)
        trial = Trial("read-only", f"{what}: {state}", end, words[:200], tuple(wrong))
    return ended(place, trial)


def read_onlys(reference: Reference) -> Iterator[Trial]:
    """Results, or the whole working folder, that cannot be written to, on a disk or by permissions."""
    states = ("everything is there", "a figure is missing", "a surface is damaged")
    for what in ("results on a disk", "working folder on a disk", "permissions of results"):
        for state, way in itertools.product(states, WAYS):
            yield read_only(reference, what, state, way)
