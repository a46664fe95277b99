"""Two calls are made at once."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator

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


def two_at_once(reference: Reference, pause: float, ways: tuple[str, str]) -> Trial:
    """Two calls for the same campaign, one after the other."""
    place = reference.empty()
    first = place.start(ways[0])
    time.sleep(pause)
    second = place.start(ways[1])
    ends = [place.end(first), place.end(second)]
    refusals = [sentence(said, "is running this campaign") for status, said in ends if status]
    wrong = [f"a call failed: {last_words(said)}" for status, said in ends if status and "is running this" not in said]
    wrong += ["both calls were refused"] if len(refusals) == 2 else []
    wrong += reference.unequal(place)
    end = REFUSED if refusals else WENT_ON
    words = " ".join("N" if word.isdigit() else word for word in "".join(refusals).split())
    return ended(place, Trial("two at once", "the same campaign", end, words[:200], tuple(wrong)))


def two_campaigns(reference: Reference, pause: float) -> Trial:
    """Two campaigns in the same folder, one after the other."""
    place = reference.empty()
    first = place.start()
    time.sleep(pause)
    targets, place.targets = place.targets, ("all",)
    second = place.start("snakemake", "--config", "name=others")
    place.targets = targets
    ends = [place.end(first), place.end(second)]
    wrong = [f"a call failed: {last_words(said)}" for status, said in ends if status]
    wrong += reference.unequal(place)
    # The other one is the same but for its name.
    surface = "surfaces/rough/seed1.nc"
    if not (place.folder / "results/others" / surface).is_file():
        wrong.append("the other campaign is not there")
    return ended(place, Trial("two at once", "two campaigns in one folder", WENT_ON, violations=tuple(wrong)))


def both(reference: Reference, trials: int, chance: random.Random) -> Iterator[Trial]:
    """Two calls at once, with random pauses between them."""
    for number in range(trials):
        ways = (WAYS[number % 2], WAYS[number // 2 % 2])
        yield two_at_once(reference, chance.uniform(0, 0.8) * reference.seconds * (number > 1), ways)
    for _ in range(3):
        yield two_campaigns(reference, chance.uniform(0, 0.5) * reference.seconds)
