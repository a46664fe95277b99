"""Processes are killed at any moment."""

from __future__ import annotations

import itertools
import os
import random
import signal
import time
from collections.abc import Iterator
from dataclasses import replace

from benchmarks.faults.places import (
    WENT_ON,
    Place,
    Reference,
    Trial,
    kill_process,
)

VICTIMS = ("Snakemake", "the whole session", "a job", "the process that the jobs are forked from", "icha run")


def kill(place: Place, reference: Reference, victim: str, moment: float, chance: random.Random) -> list[str] | None:
    """Start the campaign and kill a process after `moment` seconds; what is wrong with what is left.

    None if the call ended before.
    """
    before = place.times()
    process = place.start("icha run" if victim == VICTIMS[4] else "snakemake")
    time.sleep(moment)
    found: list[int] = []
    while not found and process.poll() is None:
        found = place.jobs() if victim == VICTIMS[2] else place.server() if victim == VICTIMS[3] else [process.pid]
        time.sleep(0.0 if found else 0.02)
    if process.poll() is not None:
        place.end(process)
        return None
    if victim == VICTIMS[1]:
        os.killpg(process.pid, signal.SIGKILL)
    else:
        kill_process(chance.choice(found))
    place.end(process)
    wrong = [f"{line} is left running" for line in place.left_behind()]
    return [*wrong, *reference.half_written(place), *computed_again(before, place)]


def computed_again(before: dict[str, int], place: Place) -> list[str]:
    """Results that were complete and are not as they were."""
    after = place.times()
    return [f"{path} was computed again" for path in before if after.get(path) != before[path]]


def kills(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Some trials in which processes are killed at random moments, as many of each kind.

    The call that goes on is killed in its turn, up to three times in a row; then it may run to its end.
    """
    victims = itertools.cycle(VICTIMS)
    made = 0
    while made < trials:
        place, row = reference.empty(), []
        for _ in range(chance.randint(1, min(3, trials - made))):
            victim = next(victims)
            wrong = kill(place, reference, victim, chance.uniform(0.1, 0.7) * reference.seconds, chance)
            if wrong is None:  # it was over before, which is no trial
                break
            row.append(Trial("kill", victim, WENT_ON, violations=tuple(wrong)))
        before = place.times()
        wrong = [*reference.goes_on(place), *computed_again(before, place)]
        made += len(row)
        if row:
            row[-1] = replace(row[-1], violations=(*row[-1].violations, *wrong))
        place.remove()
        yield from row
