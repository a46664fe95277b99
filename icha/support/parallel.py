"""Work on the cores that the process may use, with results that do not depend on how many there are."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

# Nodes a side of a grid from which on several threads pay.
LARGE_GRID = 2048


def cores() -> int:
    """Number of threads to work with: OMP_NUM_THREADS if it is set, else the processors that the process may use.

    Snakemake sets OMP_NUM_THREADS to the `threads` of a rule.
    """
    asked = os.environ.get("OMP_NUM_THREADS", "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_cores(function: Callable, items: Iterable) -> list:
    """Results of `function` for every item, in the order of the items.

    What an item is must not depend on the number of cores: then neither does any bit of the results. Threads help
    where the function spends its time in NumPy, SciPy or finufft on arrays of some size.
    """
    items = list(items)
    count = min(cores(), len(items))
    if count <= 1:
        return [function(item) for item in items]
    results, waiting = [None] * len(items), enumerate(items)

    def work():
        # Each thread takes the next item by itself: handing out many short ones would take as long as they do.
        for number, item in waiting:
            results[number] = function(item)

    with ThreadPoolExecutor(count) as pool:
        for done in [pool.submit(work) for _ in range(count)]:
            done.result()
    return results


def blocks(length: int, size: int) -> list[slice]:
    """Slices of at most `size` that cover range(length)."""
    return [slice(first, min(first + size, length)) for first in range(0, length, size)]
