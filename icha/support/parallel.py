"""Parallel work on the cores of the process, with results that do not depend on their number."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

# Nodes along a side of a grid above which several threads save time.
LARGE_GRID = 2048


def cores() -> int:
    """Return the number of threads: OMP_NUM_THREADS if it is set, otherwise that of the processors for this process.

    Snakemake sets OMP_NUM_THREADS to the `threads` of a rule.
    """
    threads = os.environ.get("OMP_NUM_THREADS", "")
    if threads.isdecimal() and int(threads) > 0:
        return int(threads)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_cores(function: Callable, items: Iterable) -> list:
    """Apply `function` to every item in threads; return the results in the order of the items.

    The results have the same bits on any number of cores if the items do not depend on it. Threads help if the function
    spends its time in NumPy, SciPy or finufft.
    """
    items = list(items)
    count = min(cores(), len(items))
    if count <= 1:
        return [function(item) for item in items]
    results, waiting = [None] * len(items), enumerate(items)

    def work():
        # Each thread takes the next item by itself, because distributing many short ones would take as long as they do.
        for number, item in waiting:
            results[number] = function(item)

    with ThreadPoolExecutor(count) as pool:
        for done in [pool.submit(work) for _ in range(count)]:
            done.result()
    return results


def blocks(length: int, size: int) -> list[slice]:
    """Return slices of at most `size` that cover range(length)."""
    return [slice(first, min(first + size, length)) for first in range(0, length, size)]
