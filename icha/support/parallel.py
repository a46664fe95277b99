"""Run work in parallel threads; the results do not depend on the number of threads."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

# Several threads save time if a grid has at least this number of nodes along a side.
LARGE_GRID = 2048


def cores() -> int:
    """Return the number of threads: OMP_NUM_THREADS if this is set, otherwise the number of available processors.

    Snakemake sets OMP_NUM_THREADS to the `threads` of a rule.
    """
    threads = os.environ.get("OMP_NUM_THREADS", "")
    if threads.isdecimal() and int(threads) > 0:
        return int(threads)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_cores(function: Callable, items: Iterable) -> list:
    """Apply a function to every item in parallel threads; return the results in the order of the items.

    The results are bitwise the same for any number of cores if the items do not depend on the number of cores. Threads
    save time if the function mainly runs code of NumPy, SciPy or finufft.
    """
    items = list(items)
    count = min(cores(), len(items))
    if count <= 1:
        return [function(item) for item in items]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(function, items))


def blocks(length: int, size: int) -> list[slice]:
    """Divide range(length) into slices of at most `size` items."""
    return [slice(first, min(first + size, length)) for first in range(0, length, size)]
