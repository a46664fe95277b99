"""Hold boundary elements in the limit of short range against what is known, and keep the numbers for their page.

python benchmarks/short_range.py [--parts PART ...]

Each part is one kind of contact (`icha.references.short_range`); the page is docs/short_range.md.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from icha.references.short_range import against_finite_range, rough_contacts, single_contacts
from icha.references.short_range.rough_contacts import HARD, SOFT, rough

RESULTS = Path(__file__).resolve().parent / "results" / "short_range"
OFFSETS = tuple(single_contacts.offsets(5))


def sphere():
    for grid, offset in itertools.product((40, 64, 100, 140), OFFSETS):
        yield from single_contacts.sphere_there_and_back(grid, offset)


def load():
    for grid, offset in itertools.product((40, 64, 100), OFFSETS[:3]):
        yield from single_contacts.sphere_under_load(grid, offset)


def pull_off():
    for grid, offset in itertools.product((40, 64, 100), OFFSETS[:3]):
        yield single_contacts.sphere_pull_off(grid, offset)


def jump_in():
    for grid, range_ in itertools.product((40, 64, 100), (0.2, 0.5)):
        yield single_contacts.sphere_jump_in(grid, range_)


def ellipse():
    for grid, angle in itertools.product((48, 64, 100, 160), (0.0, 20.0, 45.0)):
        yield from single_contacts.ellipse(grid, angle)


def punches():
    for square, (grid, cells) in itertools.product((False, True), ((64, 8), (96, 12), (128, 16))):
        yield single_contacts.flat_punch(grid, cells, square)


def strips():
    for grid in (64, 96):
        yield single_contacts.row_of_strips(grid, 0.2)


def sinusoid():
    for grid, alpha in itertools.product((32, 64, 128), (0.1, 0.3)):
        yield from single_contacts.sinusoid(grid, alpha)


def crack():
    for grid in (48, 64, 96, 128):
        yield from single_contacts.crack(grid)


def pair():
    for grid in (96, 128):
        yield from single_contacts.pair(grid)


def tamaas():
    for grid, seed in itertools.product((128, 256), (1, 2)):
        yield from against_finite_range.without_adhesion(rough(grid, grid // 8, seed=seed), (1e-3, 1e-2, 5e-2))


def ranges():
    # Waves of 50 um to 6.25 um and dgamma/E* = 20 nm, so that the attraction can be resolved.
    lengths = ((400e-9, 1), (283e-9, 2), (200e-9, 2), (141e-9, 4), (100e-9, 8))
    yield from against_finite_range.towards_short_range(rough(128, 8, 16), (2.0, 1.5), lengths, 0.5)


def loops():
    for material, step in itertools.product((HARD, SOFT), (0.2, 0.1)):
        yield rough_contacts.loop(rough(128), 1e-2, step, material) | {"adhesion": material is SOFT}


def cells():
    yield from rough_contacts.by_cells_per_wave(16, (4, 8, 16, 32), (2.4, 2.0, 1.6))


def symmetry():
    yield from rough_contacts.symmetries(rough(128), 2.0)


def steps():
    yield from rough_contacts.by_steps(rough(128), 1.8, (5, 50))


def threads():
    for count in (1, 2):
        environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), str(count))
        command = [sys.executable, "-m", "icha.references.short_range.rough_contacts", "128"]
        run = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
        yield {"threads": count, "digest": json.loads(run.stdout)}


PARTS: dict[str, Callable] = {
    part.__name__: part
    for part in (
        sphere,
        load,
        pull_off,
        jump_in,
        ellipse,
        punches,
        strips,
        sinusoid,
        crack,
        pair,
        tamaas,
        ranges,
        loops,
        cells,
        symmetry,
        steps,
        threads,
    )
}


def plain(value):
    """Numbers of NumPy as Python's."""
    return value.item() if isinstance(value, np.generic) else value


def measured(part: str) -> dict:
    """The rows of a part, the time that it took, s, and why it ended early, if it did."""
    clock, rows, failure = time.perf_counter(), [], ""
    try:
        for row in PARTS[part]():
            rows.append({name: plain(value) for name, value in row.items()})
    except Exception as error:
        # Whatever it is, it stands on the page.
        failure = f"{type(error).__name__}: {error}"
    return {"seconds": round(time.perf_counter() - clock, 1), "failure": failure, "rows": rows}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, metavar="PART", help=", ".join(PARTS))
    parts = parser.parse_args().parts
    RESULTS.mkdir(parents=True, exist_ok=True)
    for part in parts:
        print(f"{part} ...", end=" ", flush=True)
        with threadpool_limits(1):
            found = measured(part)
        partial = RESULTS / f"{part}.partial"
        partial.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        partial.replace(RESULTS / f"{part}.json")
        print(f"{len(found['rows'])} rows in {found['seconds']:.0f} s", found["failure"], flush=True)


if __name__ == "__main__":
    main()
