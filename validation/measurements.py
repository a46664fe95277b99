"""Comparisons of a page: measure their parts, save the rows, and write the tables of the page from the saved rows."""

from __future__ import annotations

import argparse
import json
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from icha import IchaWarning
from validation.tables import Table, write_tables

RESULTS = Path(__file__).resolve().parent / "results"
Rows = dict[str, list[dict]]
# For each part of a page: a function that returns a row or several rows, and its arguments, call by call.
Parts = Mapping[str, tuple[Callable, Sequence[tuple]]]


def read_rows(page: str, parts: Iterable[str]) -> Rows:
    """Read the saved rows of the parts of a page."""
    return {part: json.loads((RESULTS / page / f"{part}.json").read_text(encoding="utf-8"))["rows"] for part in parts}


def measure_page(page: str, parts: Parts, tables: Callable[[Rows], dict[str, Table]], about: str) -> None:
    """Measure the parts that the command line names, save their rows, and write the tables of the page."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=parts, default=parts, metavar="PART", help=", ".join(parts))
    parser.add_argument("--tables", action="store_true", help="write the tables from saved measurements")
    options = parser.parse_args()
    # Studies have units of their own, so that lengths may be unusual for SI units.
    warnings.simplefilter("ignore", IchaWarning)
    for part in () if options.tables else options.parts:
        print(f"{part} ...", end=" ", flush=True)
        clock = time.perf_counter()
        solve, arguments = parts[part]
        with threadpool_limits(1):
            found = [solve(*each) for each in arguments]
            rows = [row for each in found for row in ([each] if isinstance(each, dict) else each)]
        seconds = round(time.perf_counter() - clock, 1)
        text = json.dumps({"seconds": seconds, "rows": rows}, indent=1, default=lambda number: number.item())
        (RESULTS / page / f"{part}.json").write_text(text + "\n", encoding="utf-8")
        print(f"{len(rows)} rows in {seconds:.0f} s", flush=True)
    write_tables(tables(read_rows(page, parts)))
