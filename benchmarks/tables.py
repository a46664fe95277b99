"""Tables and the figure of docs/benchmarks.md, from the measurements of benchmarks/run.py."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from validation.tables import DOCS, Table, percent, write_tables

RESULTS = Path(__file__).resolve().parent / "results"
OWN = ("icha", "icha-boundary-elements")  # ICHA's models
WITH = {False: "without adhesion", True: "with adhesion"}


def read_results() -> dict[str, dict]:
    """Read all results by name."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(RESULTS.glob("*.json"))}


def select(results, prefix, **wanted) -> list[dict]:
    """Return the results with a prefix of the name and given entries."""
    return [
        result
        for name, result in results.items()
        if name.startswith(prefix) and all(result.get(key) == value for key, value in wanted.items())
    ]


def seconds(value: float) -> str:
    return f"{value:.2f} s" if value < 10 else f"{value:.0f} s"


def times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 10 else f"{ratio:.0f}"


# --- the sweep ----------------------------------------------------------------------------------------------------


def surfaces(results) -> Table:
    """Table of the surfaces of the sweeps."""
    rows = [
        [
            f"{task['grid']}²",
            f"{task['short_wavelength'] * 1e6:.3g} µm",
            f"{task['rms_height'] * 1e6:.3g} µm",
            f"{task['interaction_range'] * 1e9:.3g} nm",
            f"{task['tabor_parameter']:.2f}",
        ]
        for task in sorted(select(results, "task-"), key=lambda task: task["grid"])
    ]
    return Table(["grid", "shortest wave", "h_rms", "range ρ", "Tabor parameter"], rows, numbers=True)


def same_sweep_of_icha(results, result) -> dict:
    """Return ICHA's sweep with the stops of another code."""
    same = {key: result[key] for key in ("grid", "adhesion", "control")}
    (found,) = select(results, "sweep-icha-", code="icha", outcome="complete", **same)
    return found


def computation(result) -> float:
    """Return the seconds from the end of the imports to the last stop."""
    return result["stops"][-1]["seconds"]


def differences(results, result) -> list[str]:
    """Format median and range of the differences of area and gap, or load, between ICHA and another code."""
    pairs = list(zip(same_sweep_of_icha(results, result)["stops"], result["stops"], strict=False))

    def spread(name):
        values = np.array([mine[name] / theirs[name] - 1 for mine, theirs in pairs])
        median, least, most = (f"{percent(value, 1)} %" for value in (np.median(values), values.min(), values.max()))
        return f"{median} ({least} to {most})"

    if result["control"] == "gap":
        return [spread("area_fraction"), "load " + spread("pressure")]
    rms_height = results[f"task-{result['grid']}"]["rms_height"]
    gap = np.array([(mine["mean_gap"] - theirs["mean_gap"]) / rms_height for mine, theirs in pairs])
    return [spread("area_fraction"), f"gap {np.median(gap):+.3f} ({gap.min():+.3f} to {gap.max():+.3f}) h_rms"]


def sweep(results, adhesion) -> Table:
    """Table with a row per grid and code, ICHA first; a code that was stopped at its limit has lower bounds."""
    rows = []

    def order(run):
        own = run["code"] != "icha", run["code"] not in OWN
        return run["grid"], *own, run["control"] != "load", run["code"], run["threads"]

    for result in sorted(select(results, "sweep-", adhesion=adhesion), key=order):
        grid = f"{result['grid']}²"
        name = result["code"] + (", given gaps" if result["control"] == "gap" else "")
        name += f", {result['threads']} threads" if result["threads"] > 1 else ""
        if not result.get("stops"):
            rows.append([grid, name, f"{result['outcome']}: {result['last_words']}", *[""] * 8])
            continue
        more = "> " if result["outcome"] == "over time" else ""
        compute = f"{len(result['stops'])} stops in " if more else ""
        ratios = ["1", "1", "1", "", ""]
        if result["code"] != "icha":
            icha = same_sweep_of_icha(results, result)
            ratios = [
                more + times(result["processor"] / icha["processor"]),
                more + times(computation(result) / computation(icha)),
                times(result["peak"] / icha["peak"]),
                *differences(results, result),
            ]
        spent = [more + seconds(result["wall"]), more + seconds(result["processor"])]
        spent += [compute + seconds(computation(result)), f"{result['peak'] / 2**20:.0f} MiB"]
        rows.append([grid, name, *spent, *ratios])
    head = ["grid", "code", "wall", "processor", "computation", "memory", "time / ICHA's", "computation / ICHA's"]
    return Table([*head, "memory / ICHA's", "ICHA's area", "and gap or load"], rows, numbers=True)


# --- the figure --------------------------------------------------------------------------------------------------


def draw_sweep(results, path: Path) -> None:
    """Draw processor time of a sweep over the nodes along a side, one line per code."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), sharey=True, layout="constrained")
    others = sorted({run["code"] for run in select(results, "sweep-")} - {"icha"})
    colours = {"icha": "black"} | {code: f"C{number}" for number, code in enumerate(others)}
    lines = {}
    for axis, adhesion in zip(axes, (False, True), strict=True):
        runs = select(results, "sweep-", adhesion=adhesion, threads=1, outcome="complete")
        for code, control in sorted({(run["code"], run["control"]) for run in runs}):
            line = sorted(
                (run["grid"], run["processor"]) for run in runs if (run["code"], run["control"]) == (code, control)
            )
            style = {"lw": 2.5 if code == "icha" else 1.5, "ls": "--" if control == "gap" else "-"}
            (lines[f"{code}, given {control}s"],) = axis.loglog(
                *zip(*line, strict=True), marker="o", color=colours[code], **style
            )
        axis.set_title(WITH[adhesion])
        axis.set_xlabel("nodes along a side")
        grids = sorted({run["grid"] for run in runs})
        axis.set_xticks(grids, [str(grid) for grid in grids], minor=False)
        axis.set_xticks([], minor=True)
        axis.grid(alpha=0.3)
    figure.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=4, fontsize=8)
    axes[0].set_ylabel("processor time of the process, s")
    figure.savefig(path, dpi=110, metadata={"Software": None})


def tables(results) -> dict[str, Table]:
    """Return all tables of the page."""
    found = {"surfaces": surfaces(results), "bare": sweep(results, False), "adhesive": sweep(results, True)}
    return {f"benchmarks_{name}": table for name, table in found.items()}


if __name__ == "__main__":
    results = read_results()
    write_tables(tables(results))
    draw_sweep(results, DOCS / "images/benchmark_sweep.png")
