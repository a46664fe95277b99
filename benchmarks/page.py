"""Write docs/benchmarks.md and its figures from what benchmarks/run.py kept; nothing is measured here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent / "docs"
MINUTE, MIB, GIB = 60.0, 2.0**20, 2.0**30
OWN = ("icha", "icha-boundary-elements")  # ICHA's models
LEAST_SPOTS = 1000  # below, fixed costs hide the exponent


def read_results(folder: Path) -> dict[str, dict]:
    """All results by name."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}


def chosen(results, prefix, **wanted) -> list[dict]:
    """The results whose name starts so and whose entries are those."""
    return [
        result
        for name, result in results.items()
        if name.startswith(prefix) and all(result.get(key) == value for key, value in wanted.items())
    ]


def grids(results) -> list[int]:
    """The grids of the sweeps."""
    return sorted({result["grid"] for result in chosen(results, "sweep-")})


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table, numbers to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def seconds(value: float) -> str:
    return f"{value:.2f} s" if value < 10 else f"{value:.0f} s"


def times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 10 else f"{ratio:.0f}"


def mib(value: float) -> str:
    return f"{value / MIB:.0f} MiB"


def percent(value: float) -> str:
    return f"{100 * value:+.1f} %"


# --- (a) the sweep ------------------------------------------------------------------------------------------------


def rival(results, result) -> dict | None:
    """ICHA's sweep with the stops of another code's."""
    found = chosen(
        results,
        "sweep-icha-",
        code="icha",
        grid=result["grid"],
        adhesion=result["adhesion"],
        control=result["control"],
        outcome="complete",
    )
    return found[0] if found else None


def computation(result) -> float:
    """Seconds from the end of the imports to the last stop that was reached."""
    return result["stops"][-1]["seconds"]


def speed_up(results, result) -> float | None:
    """How many times ICHA's time another code took (at least, if it was stopped); None where there is none."""
    icha = rival(results, result)
    if icha is None or result["outcome"] == "failed":
        return None
    return result["processor"] / icha["processor"]


def differences(results, result) -> list[str]:
    """ICHA's area and gap, or load, against another code's, over their common stops."""
    icha = rival(results, result)
    pairs = list(zip(icha["stops"], result.get("stops", []), strict=False)) if icha else []
    if not pairs:
        return ["", ""]
    rms_height = results[f"task-{result['grid']}"]["rms_height"]

    def spread(values):
        values = np.array(values)
        return f"{percent(np.median(values))} ({percent(values.min())} to {percent(values.max())})"

    area = spread([mine["area_fraction"] / theirs["area_fraction"] - 1 for mine, theirs in pairs])
    if result["control"] == "gap":
        return [area, "load " + spread([mine["pressure"] / theirs["pressure"] - 1 for mine, theirs in pairs])]
    gap = np.array([(mine["mean_gap"] - theirs["mean_gap"]) / rms_height for mine, theirs in pairs])
    return [area, f"gap {np.median(gap):+.3f} ({gap.min():+.3f} to {gap.max():+.3f}) h_rms"]


def sweep_rows(results, grid, adhesion) -> list[list[str]]:
    """A row per code, ICHA first."""
    rows = []
    order = sorted(
        chosen(results, "sweep-", grid=grid, adhesion=adhesion),
        key=lambda r: (r["code"] != "icha", r["code"] not in OWN, r["control"] != "load", r["code"], r["threads"]),
    )
    for result in order:
        name = result["code"] + (", given gaps" if result["control"] == "gap" else "")
        name += f", {result['threads']} threads" if result["threads"] > 1 else ""
        if result["outcome"] == "failed":
            rows.append([name, f"failed: {result['last_words']}"])
            continue
        stopped = result["outcome"] == "over time"
        more = "> " if stopped else ""
        compute = seconds(computation(result)) if result.get("stops") else ""
        if stopped:
            compute = f"{len(result.get('stops', []))} stops in {compute or 'none'}"
        ratios = ["1", "1", "1", "", ""]
        if result["code"] != "icha" and (icha := rival(results, result)):
            ratios = [more + times(result["processor"] / icha["processor"])]
            ratios += [more + times(computation(result) / computation(icha)) if result.get("stops") else ""]
            ratios += [times(result["peak"] / icha["peak"]), *differences(results, result)]
        rows.append(
            [
                name,
                more + seconds(result["wall"]),
                more + seconds(result["processor"]),
                compute,
                mib(result["peak"]),
                *ratios,
            ]
        )
    return [row + [""] * (10 - len(row)) for row in rows]


def fastest(results, grid, adhesion) -> tuple[float, str, bool] | None:
    """The smallest speed-up over another code at one thread, that code, and whether it was stopped at its limit."""
    ratios = [
        (ratio, result["code"], result["outcome"] == "over time")
        for result in chosen(results, "sweep-", grid=grid, adhesion=adhesion, threads=1)
        if result["code"] not in OWN and (ratio := speed_up(results, result)) is not None
    ]
    return min(ratios) if ratios else None


# --- (b) the scaling ----------------------------------------------------------------------------------------------


def points(results, adhesion) -> np.ndarray:
    """Rows (spots, seconds, memory) of the complete runs of the scaling, with growing number of spots."""
    rows = [
        (run["stops"][-1]["spots"], run["stops"][-1]["seconds"], run["stops"][-1]["peak"] - run["memory_before"])
        for run in chosen(results, "scaling-", adhesion=adhesion, outcome="complete")
    ]
    return np.array(sorted(rows)).reshape(-1, 3)


def exponent(results, adhesion, column: int) -> float | None:
    """Slope of the logarithm of time (column 1) or memory (2) over that of the number of spots, by least squares."""
    data = points(results, adhesion)
    data = data[data[:, 0] >= LEAST_SPOTS]
    if len(data) < 2 or np.any(data[:, column] <= 0):
        return None
    return float(np.polyfit(np.log(data[:, 0]), np.log(data[:, column]), 1)[0])


# --- the targets --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Verdict:
    """A target, what was measured (empty: nothing), and whether it is reached."""

    target: str
    measured: str
    reached: bool | None

    def row(self) -> list[str]:
        word = {True: "reached", False: "**not reached**", None: "not measured"}[self.reached]
        return [self.target, self.measured or "–", word]


WITH = {False: "without adhesion", True: "with adhesion"}


def verdicts(results) -> list[Verdict]:
    """The targets against what was measured."""
    found = []
    for adhesion, most in ((False, 2.5), (True, 2)):
        target = f"full challenge surface by asperities, {WITH[adhesion]}: at most {most:g} min and 8 GiB"
        full = chosen(results, "stages-challenge-", adhesion=adhesion)
        if full and full[0]["outcome"] == "complete":
            (run,) = full[:1]
            # Measuring the stages resets the system's record of the largest memory.
            peak = max([run["peak"], *run["peaks"].values()])
            reached = run["wall"] <= most * MINUTE and peak <= 8 * GIB and run["stops"] == run["stops_asked"]
            text = f"{run['wall'] / MINUTE:.1f} min, {peak / GIB:.1f} GiB"
            if run["failure"]:
                text += f"; {run['stops']} of {run['stops_asked']} stops: {run['failure']}"
            found.append(Verdict(target, text, reached))
        else:
            text = f"{full[0]['outcome']} after {full[0]['wall'] / MINUTE:.1f} min" if full else ""
            found.append(Verdict(target, text, False if full else None))
    for adhesion in (False, True):
        target = f"20 loads at 512² by asperities, {WITH[adhesion]}: at most 0.5 s of computation"
        run = chosen(
            results, "sweep-icha-", code="icha", grid=512, adhesion=adhesion, control="load", outcome="complete"
        )
        value = computation(run[0]) if run else None
        found.append(Verdict(target, seconds(value) if run else "", value <= 0.5 if run else None))
    for adhesion, wanted in ((False, 30), (True, 100)):
        target = f"at 1024², {WITH[adhesion]}: at least {wanted} times faster than the fastest other code"
        best = fastest(results, 1024, adhesion)
        text = f"{'more than ' if best[2] else ''}{best[0]:.1f} times ({best[1]})" if best else ""
        if best:
            others = chosen(
                results, "sweep-", grid=1024, adhesion=adhesion, threads=1, code=best[1], outcome="complete"
            )
            alone = [computation(other) / computation(icha) for other in others if (icha := rival(results, other))]
            text += f"; computation alone {min(alone):.0f} times" if alone else ""
        found.append(Verdict(target, text, best[0] >= wanted if best else None))
    for adhesion in (False, True):
        value = exponent(results, adhesion, 1)
        target = f"time over number of spots, {WITH[adhesion]}: exponent at most 1.15"
        failed = [r for r in chosen(results, "scaling-", adhesion=adhesion) if r["outcome"] != "complete"]
        text = "" if value is None else f"{value:.2f}" + (f"; {len(failed)} runs did not end" if failed else "")
        found.append(Verdict(target, text, None if value is None else value <= 1.15 and not failed))
    for grid, adhesion, most in ((512, False, 5), (512, True, 10), (1024, False, 30), (1024, True, 60)):
        target = f"20 loads at {grid}² by ICHA's boundary elements, {WITH[adhesion]}: at most {most} s on one core"
        run = chosen(results, "sweep-icha-boundary-elements-", grid=grid, adhesion=adhesion)
        text = seconds(run[0]["processor"]) if run else ""
        if run and run[0]["outcome"] != "complete":
            text = f"{run[0]['outcome']} after {seconds(run[0]['wall'])}, {len(_stops(run[0]))} stops"
        reached = run[0]["outcome"] == "complete" and run[0]["processor"] <= most if run else None
        found.append(Verdict(target, text, reached))
    for grid, adhesion, wanted in ((512, False, 1), (512, True, 8), (1024, False, 1), (1024, True, 8)):
        target = f"at {grid}², ICHA's boundary elements {WITH[adhesion]}: at least {wanted} times as fast as "
        target += "the fastest other code" + (", whose range is far longer" if adhesion else "")
        best = _boundary_elements_against_others(results, grid, adhesion)
        found.append(
            Verdict(target, f"{best[0]:.1f} times ({best[1]})" if best else "", best[0] >= wanted if best else None)
        )
    target = "20 areas of the full challenge surface by ICHA's boundary elements, with adhesion, on two cores: at most "
    target += "90 min and 10 GiB"
    truth = results.get("truth")
    text = f"{truth['wall'] / MINUTE:.0f} min, {truth['peak'] / GIB:.1f} GiB" if truth else ""
    reached = truth["wall"] <= 90 * MINUTE and truth["peak"] <= 10 * GIB and not truth["failure"] if truth else None
    found.append(Verdict(target, text, reached))
    residuals = [
        stop["residual"] for name, result in results.items() for stop in _stops(result) if "residual" in stop
    ] + [result["residual"] for result in chosen(results, "stages-") if "residual" in result]
    target = "equilibrium residual at every stop: at most 1e-8 h_rms"
    worst = max(residuals, default=None)
    found.append(Verdict(target, f"{worst:.1e}" if residuals else "", worst <= 1e-8 if residuals else None))
    digests = {}
    for result in chosen(results, "stages-512-", outcome="complete"):
        digests.setdefault(result["adhesion"], {})[result["threads"]] = result["digest"]
    compared = [set(by_threads.values()) for by_threads in digests.values() if len(by_threads) > 1]
    same = all(len(values) == 1 for values in compared)
    text = ("same" if same else "different") + " bytes with 1 and 2 threads at 512²" if compared else ""
    found.append(Verdict("the number of threads never changes a byte", text, same if compared else None))
    plan = results.get("campaign-plan")
    target = "plan of a campaign of 10 000 runs: at most 15 s and 2 GiB"
    text = f"{plan['wall']:.0f} s, {plan['peak'] / GIB:.1f} GiB" if plan else ""
    reached = plan["outcome"] == "complete" and plan["wall"] <= 15 and plan["peak"] <= 2 * GIB if plan else None
    found.append(Verdict(target, text, reached))
    target = "1 000 runs at 128² on two cores: at least 60 % of the time in the contact solver"
    shares = {runs["grid"]: solver_share(runs) for runs in chosen(results, "campaign-runs-")}
    text = ", ".join(f"{shares[grid]:.0%} at {grid}²" for grid in sorted(shares))
    found.append(Verdict(target, text, shares[128] >= 0.6 if 128 in shares else None))
    target = "campaign dataset and checks of 10 000 runs: together at most 120 s"
    parts = [results[name] for name in ("dataset-write-10000", "dataset-check-10000") if name in results]
    text = " and ".join(seconds(part["wall"]) for part in parts)
    together = all(part["outcome"] == "complete" for part in parts) and sum(part["wall"] for part in parts) <= 120
    found.append(Verdict(target, text, together if len(parts) == 2 else None))
    target = "the paper's campaign by both models on two cores: at most 90 s"
    paper = results.get("campaign-paper")
    reached = paper["outcome"] == "complete" and paper["wall"] <= 90 if paper else None
    found.append(Verdict(target, seconds(paper["wall"]) if paper else "", reached))
    for name, (what, most) in STARTS.items():
        run = results.get(name)
        text = f"{_processor(run):.2f} s" if run else ""
        reached = run.get("outcome", "complete") == "complete" and _processor(run) <= most if run else None
        found.append(Verdict(f"{what}: at most {most:g} s of processor time", text, reached))
    return found


def _boundary_elements_against_others(results, grid, adhesion) -> tuple[float, str] | None:
    """The smallest ratio of processor times of another code and of ICHA's boundary elements, and that code."""
    runs = chosen(results, "sweep-", grid=grid, adhesion=adhesion, threads=1, outcome="complete")
    own = [run for run in runs if run["code"] == "icha-boundary-elements"]
    ratios = [(run["processor"] / own[0]["processor"], run["code"]) for run in runs if own and run["code"] not in OWN]
    return min(ratios, default=None)


# What people wait for, by the name of its result, with the processor time that it may take, s.
STARTS = {
    "start-help": ("`icha --help`", 0.3),
    "start-describe-paper": ("`icha describe` of the paper's campaign", 0.8),
    "start-describe-template": ("`icha describe` of a new campaign", 0.8),
    "start-show": ("`icha show` of a run", 1.0),
    "start-check": ("`icha check` of a run", 1.0),
    "start-simulate": ("import of icha and the first `icha.simulate`, without its computation", 1.2),
    "start-nothing-to-do": ("`icha run` (`make run`) with nothing to do, the paper's campaign", 2.5),
}


def _processor(start) -> float:
    """Processor time of a call, s; of the first simulation what it takes beside the computation."""
    return start["overhead"] if "overhead" in start else start["processor"]


def solver_share(runs) -> float:
    """Part of the cores' time of a whole campaign that the contact solver takes."""
    return runs["seconds_a_run"] * runs["runs"] / (runs["cores"] * runs["whole"]["wall"])


def _stops(result) -> list[dict]:
    stops = result.get("stops", [])
    return stops if isinstance(stops, list) else []


# --- the page -----------------------------------------------------------------------------------------------------


def page(results: dict[str, dict]) -> str:
    """The page as Markdown."""
    machine = results["machine"]
    versions = machine["versions"] | {
        r["code"]: r["version"] for r in chosen(results, "sweep-") if r["code"] not in OWN and "version" in r
    }
    parts = [
        "# Benchmarks",
        "`make benchmarks` measures all numbers on this page. It installs the boundary-element codes in an environment "
        "of their own (`.venv-benchmarks`; `aspher` is built from its source and needs a C++17 compiler and Eigen, on "
        "Debian `apt install libeigen3-dev`), runs one process at a time, keeps the results in `benchmarks/results` "
        "and writes this page from them. To measure a part again, use, for example, "
        "`make benchmarks OPTIONS='--only icha --parts sweep'`.",
        f"Machine: {machine['processor']}, {machine['cores']} cores, {machine['memory'] / GIB:.0f} GiB, "
        f"{machine['system']}, Python {machine['python']}; "
        + ", ".join(f"{name} {number}" for name, number in sorted(versions.items()))
        + ".",
        "## Targets",
        table(["target", "measured", ""], [verdict.row() for verdict in verdicts(results)]).replace("---:", "---"),
        "### Why some are missed",
        MISSED_TEXT,
        "## One sweep against boundary-element codes",
        SWEEP_TEXT,
        _surfaces(results),
        _settings(results),
    ]
    head = ["code", "wall", "processor", "computation", "memory", "time / ICHA's", "computation / ICHA's"]
    head += ["memory / ICHA's", "ICHA's area", "and gap or load"]
    for grid in grids(results):
        for adhesion in (False, True):
            rows = sweep_rows(results, grid, adhesion)
            if rows:
                parts += [f"### {grid}², {WITH[adhesion]}", table(head, rows)]
    parts += ["![Time of a sweep](images/benchmark_sweep.png)", "## Number of spots", SCALING_TEXT, _scaling(results)]
    parts += ["![Time and memory over the number of spots](images/benchmark_scaling.png)"]
    parts += ["## Where the time goes", STAGES_TEXT, _stages(results)]
    parts += _truth(results)
    parts += _starts(results)
    parts += _campaigns(results)
    return "\n\n".join(part for part in parts if part) + "\n"


def _truth(results) -> list[str]:
    """The section on the full challenge surface by boundary elements."""
    truth = results.get("truth")
    if not truth:
        return []
    rows = [
        [
            f"{1e6 * stop['mean_separation']:.2f} µm",
            f"{stop['reduced_pressure']:.3g}",
            f"{100 * stop['contact_area_fraction']:.3f} %",
            f"{stop['spot_count']:.0f}",
        ]
        for stop in truth["stops"]
    ]
    spent = f"{truth['wall'] / MINUTE:.0f} min on {truth['cores']} cores, {truth['peak'] / GIB:.1f} GiB"
    left = [max(stop[name] for stop in truth["stops"]) for name in ("residual", "front_residual")]
    return [
        "## The full challenge surface by boundary elements",
        f"{TRUTH_TEXT} It took {spent}. Displacements are off by {left[0]:.0e} h_rms, and √(G/Δγ) along the fronts by "
        f"{left[1]:.0e}, at most. {truth['failure']}".rstrip(),
        table(["mean separation", "p\\*", "A/A0", "patches"], rows),
    ]


def _campaigns(results) -> list[str]:
    """What the workflow costs beside the solver."""
    parts = ["## Whole campaigns", CAMPAIGNS_TEXT]
    rows = []
    if plan := results.get("campaign-plan"):
        rows.append([f"plan (`-n`) of {plan['runs']} runs", seconds(plan["wall"]), mib(plan["peak"]), ""])
    for runs in sorted(chosen(results, "campaign-runs-"), key=lambda runs: runs["grid"]):
        share = f"{solver_share(runs):.0%} in the contact solver ({runs['seconds_a_run']:.2f} s a run)"
        rows.append(
            [
                f"{runs['runs']} runs at {runs['grid']}² on {runs['cores']} cores",
                seconds(runs["whole"]["wall"]),
                "",
                share,
            ]
        )
    for part, what in (("write", "campaign dataset"), ("check", "checks")):
        for each in sorted(chosen(results, f"dataset-{part}-"), key=lambda each: each["runs"]):
            rows.append([f"{what} of {each['runs']} runs", seconds(each["wall"]), mib(each["peak"]), ""])
    if paper := results.get("campaign-paper"):
        rows.append([f"the paper's campaign on {paper['cores']} cores", seconds(paper["wall"]), "", ""])
    if not rows:
        return []
    parts.append(table(["", "time", "memory", "of the time"], rows))
    return parts


def _starts(results) -> list[str]:
    """The section on what people wait for."""
    rows = [
        [
            what,
            f"{_processor(results[name]):.2f} s",
            f"{results[name]['wall']:.2f} s" if "wall" in results[name] else "",
            mib(results[name]["peak"]) if "peak" in results[name] else "",
        ]
        for name, (what, _) in STARTS.items()
        if name in results
    ]
    return ["## The first second", STARTS_TEXT, table(["", "processor", "wall", "memory"], rows)] if rows else []


# Counted apart from the benchmarks, by hand; to be looked at again where the solvers change.
MISSED_TEXT = """\
**Boundary elements with adhesion** are bound by their transforms. At 512² a stop takes some 470 of them there and back,
which is 62 % of the time, the rest being spread out. A third of these bring the fronts to the neighbourhood of the new
load, a fifth to the load nearly, and 30 % to it within 5·10⁻¹⁰ and along all fronts to 10⁻⁹ of √(G/Δγ); 14 % are for
the slopes of load and area. Each decimal of a linear equation takes nine. The following was tried, and did not help:

- Newton's steps of fronts and separation together: as many transforms, since each step has to be solved as exactly.
- A preconditioner with the neighbours of the front (sparse, factorised): 12 instead of 14 iterations, and a
  factorisation that takes as long. One that is triangular in closed cells and front: more iterations than without.
- Windows of a grid (tiles of 128²) instead of whole transforms below 1024²: as long for each cell.

Other libraries are faster (FFTW by a third, MKL by a half), but FFTW and ducc0 are under the GPL, and the bits of MKL
depend on the processor.

**The full surface by boundary elements** was solved once, in parts and not by this command: its first 18 equilibria
took some 3.7 h, partly beside other work and with an error that cost steps, the last two 82 min on two cores; at most
10.2 GiB were needed. A stop lasts the longer the more contact there is: half a minute at 0.1 % of area, forty minutes
at 10 %, where 4.5 million cells touch. On 2048² cells with the same waves a stop at 4 % of area took 745 sums over
tiles there and back; on 8192² one takes a second at 7 %. [What came out](howto/large.md) is on another page.

**Asperities.** The time of a product with the tangent grows about in proportion to the number of spots, but a linear
equation takes more of them: 8, 9 and 12 with 12 000, 30 000 and 105 000 spots. The larger the surface, the longer waves
it has, and the more its spots move together. Taking these waves out beforehand, by the mean stiffness of all spots,
halves the iterations (7 instead of 13, 8 instead of 15), but its own sums take as long as it saves. From 30 000 spots
on arrays also leave the cache."""

TRUTH_TEXT = """\
Campaign `cmc_truth` solves the surface of the [Contact Mechanics Challenge](howto/large.md), 8192² cells, in the limit
of a short range of attraction, with the challenge's adhesion. The loads and the areas are what came out."""

STARTS_TEXT = """\
The table shows what the command line takes before anything is computed: the quickest of three calls, all processes of a
call together. As in every call but the first, modules are compiled already, and what Snakemake's fingerprints need to
know of them has been read once. `make` itself adds some hundredths of a second to `icha run`."""

CAMPAIGNS_TEXT = """\
These are campaigns of small runs: 7 loads and five surface energies on 200 random surfaces of 128² or 256² nodes. For
the share of the contact solver, 100 of the runs are computed again in two processes side by side (`icha.simulate`).
Their time, scaled to all runs, is divided by the time of both cores from the call of Snakemake to its end, which
includes surfaces, runs, dataset, comparison, checks, figure and report. The plan is that of 10 000 such runs. The
campaign dataset is written from, and checked with, files of runs of 15 loads."""

SWEEP_TEXT = """\
Every code is given the same heights and the same 20 stops. It is measured as a whole process, with imports and reading,
on one thread unless the table says otherwise. *Computation* is the wall time from the end of the imports to the last
stop. *Time / ICHA's* is the ratio of the processor times of whole processes; on one thread and a quiet machine this is
the same as the ratio of wall times. *Computation / ICHA's* is the ratio of the computations alone. *Memory* is the
largest resident memory. ICHA and `aspher` had the machine to themselves. Another code had not, where its wall time is
longer than its processor time; there the ratio of the computations flatters ICHA by as much. Like the other codes, ICHA
is asked for bare numbers (`icha.path.follow`). The labelled dataset of `icha.simulate` needs xarray in
addition, whose import is part of the first call ([first second](#the-first-second)). At 256² about half of ICHA's time
goes into imports. The loads are
20 reduced pressures p\\* = p/(E\\* h'_rms) from 5e-4 to 8e-2 in geometric progression. The surfaces have
the spectrum of the challenge (period 100 µm, roll-off 20 µm, Hurst exponent 0.8, rms slope 1) down to waves of eight
grid cells, so that every grid has all the waves that it can resolve as recommended for ICHA.

Speed must be seen together with the error. The last two columns say how far the area of ICHA is from that of the other
code at the same stop, and the same for the mean gap (in h_rms) or, where the gap is given, for the load: the median
over the stops and the range. The areas of the boundary-element codes are corrected by the perimeter of the contact
(Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161-171).

With adhesion, a boundary-element code must resolve the range ρ of the attraction (exponential, energy 50 mJ/m², E\\* =
25 MPa): on a grid of spacing Δ, Δ ≤ 8 ρ² E\\*/(3π γ) and √(γ Δ/E\\*)/ρ < 0.5. These grids resolve only ranges much
longer than the challenge's 2.07 nm, and all codes are given the same one. The Tabor parameter is then far below 1,
below which ICHA's law of jump-in was not verified; this causes part of the differences in area. `adhesion` is given the
loads. `tamaas` does not find adhesive equilibria reliably at a given load, and is therefore given the mean gaps of
ICHA's states at those loads; ICHA is measured with both. `icha-boundary-elements`, ICHA's other model, is the limit of
a short range ([short range](short_range.md)). It has no range to resolve, so that with adhesion its area, like that of
ICHA's asperities, differs from that of the codes with so long a range."""

SCALING_TEXT = """\
The solver alone is measured, from the asperities to the last of the same 20 loads, on one thread, with the material of
the challenge. The surfaces are k × k patches of asperities side by side. A patch is a realisation of the spectrum
above, cut off at 1/64 of its period (512², period 100 µm), and shifted at random; 16 realisations are used in turn. So
the surfaces differ only in size. Heights do not join at the seams, but a solver that is given asperities does not see
this. *Memory* is what the sweep adds to the process after the asperities have been read. This part was measured later
than the others, on a day on which the machine took 1.5 times as long for the same sweep: its times are not to be held
against theirs."""

STAGES_TEXT = """\
One process, two threads unless said otherwise: the surface, its summits, the path, the fields of a snapshot at p\\*
= 0.01 (challenge only), and the rest: the dataset, the tangents for the stiffness, and the file. At 512² the path has
the 20 loads above. On the full challenge surface (8192², all waves from 100 µm to 0.1 µm, the challenge's material) it
has 20 contact areas from 0.1 % to 10 % of the nominal one. Memory is the largest resident memory during the stage."""


def _surfaces(results) -> str:
    rows = [
        [
            f"{task['grid']}²",
            f"{task['short_wavelength'] * 1e6:.3g} µm",
            f"{task['rms_height'] * 1e6:.3g} µm",
            f"{task['interaction_range'] * 1e9:.3g} nm",
            f"{task['tabor_parameter']:.2f}",
        ]
        for task in sorted(chosen(results, "task-"), key=lambda task: task["grid"])
    ]
    return table(["grid", "shortest wave", "h_rms", "range ρ", "Tabor parameter"], rows)


def _settings(results) -> str:
    used = {(r["code"], r["settings"]) for r in chosen(results, "sweep-") if r["code"] not in OWN and r.get("settings")}
    lines = [f"- `{code}`: {settings}." for code, settings in sorted(used)]
    elsewhere = {
        (r["machine"], r["code"])
        for r in chosen(results, "sweep-")
        if r.get("machine", results["machine"]["processor"]) != results["machine"]["processor"]
    }
    lines += [f"- `{code}` was measured on another machine: {name}." for name, code in sorted(elsewhere)]
    limits = sorted({r["limit"] for r in chosen(results, "sweep-")})
    lines += [f"- Time limit of a process: {', '.join(f'{limit / MINUTE:.2g}' for limit in limits)} min."]
    return "\n".join(lines)


def _scaling(results) -> str:
    rows = []
    for run in sorted(chosen(results, "scaling-"), key=lambda run: (run["adhesion"], run["patches"])):
        last = run["stops"][-1] if run.get("stops") else None
        if run["outcome"] == "complete":
            end = f"{last['area_fraction']:.3f}"
        else:
            end = f"{run['outcome']} after {len(run.get('stops', []))} stops {run['last_words']}".strip()
        rows.append(
            [
                WITH[run["adhesion"]],
                str(run["patches"]),
                str(run.get("asperities", "")),
                str(last["spots"]) if last else "",
                seconds(last["seconds"]) if last else "",
                mib(last["peak"] - run["memory_before"]) if last else "",
                end,
            ]
        )
    head = ["", "k", "asperities", "spots at the end", "time", "memory", "A/A0 at the end"]
    text = [table(head, rows)] if rows else []
    for adhesion in (False, True):
        time, memory = (exponent(results, adhesion, column) for column in (1, 2))
        if time is not None:
            text.append(
                f"From {LEAST_SPOTS} spots on, {WITH[adhesion]}: time grows with the number of spots to the power of "
                f"{time:.2f}" + (f", memory to that of {memory:.2f}." if memory is not None else ".")
            )
    return "\n\n".join(text)


def _stages(results) -> str:
    tables = []
    for surface, title in (("512", "512²"), ("challenge", "full challenge surface, 8192²")):
        for adhesion in (False, True):
            runs = chosen(results, f"stages-{surface}-", adhesion=adhesion)
            runs = sorted(runs, key=lambda run: -run["threads"])[:1]
            for run in runs:
                tables.append(f"### {title}, {WITH[adhesion]}")
                if run["outcome"] != "complete":
                    tables.append(f"{run['outcome']} after {run['wall']:.0f} s: {run['last_words']}")
                    continue
                order = ("surface", "summits", "path", "fields of the snapshot", "dataset")
                rows = [[s, seconds(run["seconds"][s]), mib(run["peaks"][s])] for s in order if s in run["seconds"]]
                rows.append(["whole process", seconds(run["wall"]), mib(max(run["peak"], *run["peaks"].values()))])
                tables.append(table(["stage", "time", "memory"], rows))
                counts = ", ".join(f"{count} {what}" for what, count in run["counts"].items())
                text = (
                    f"Threads: {run['threads']}; {run['asperities']} asperities; "
                    f"{run['stops']} of {run['stops_asked']} stops, "
                    f"at the last one {run['spots']} spots and A/A0 = {run['area_fraction']:.3f}; "
                    f"{counts}; residual at most {run['residual']:.1e} h_rms."
                )
                tables.append(text + (f" {run['failure']}" if run["failure"] else ""))
    return "\n\n".join(tables)


# --- the figures --------------------------------------------------------------------------------------------------


def draw_sweep(results, path: Path) -> None:
    """Processor time of a sweep over the nodes along a side, one line per code."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), sharey=True, layout="constrained")
    others = sorted({run["code"] for run in chosen(results, "sweep-")} - {"icha"})
    colours = {"icha": "black"} | {code: f"C{number}" for number, code in enumerate(others)}
    lines = {}
    for axis, adhesion in zip(axes, (False, True), strict=True):
        runs = chosen(results, "sweep-", adhesion=adhesion, threads=1, outcome="complete")
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
        axis.set_xticks(grids(results), [str(grid) for grid in grids(results)], minor=False)
        axis.set_xticks([], minor=True)
        axis.grid(alpha=0.3)
    if lines:
        figure.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=4, fontsize=8)
    axes[0].set_ylabel("processor time of the process, s")
    _save(figure, path)


def draw_scaling(results, path: Path) -> None:
    """Time and memory of the solver over the number of spots."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
    for column, axis, label in ((1, axes[0], "time, s"), (2, axes[1], "memory, MiB")):
        for adhesion, marker in ((False, "o-"), (True, "s-")):
            data = points(results, adhesion)
            if len(data):
                value = data[:, column] / (MIB if column == 2 else 1)
                slope = exponent(results, adhesion, column)
                power = "" if slope is None else f", exponent {slope:.2f}"
                axis.loglog(data[:, 0], value, marker, label=WITH[adhesion] + power)
        axis.set_xlabel("spots at the last load")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        if axis.lines:
            axis.legend(fontsize=8)
    _save(figure, path)


def _save(figure, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def write(results: dict[str, dict], docs: Path) -> None:
    """Write the page and its figures below `docs`."""
    draw_sweep(results, docs / "images" / "benchmark_sweep.png")
    draw_scaling(results, docs / "images" / "benchmark_scaling.png")
    (docs / "benchmarks.md").write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    write(read_results(HERE / "results"), DOCS)
