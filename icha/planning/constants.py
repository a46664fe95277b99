"""What the formulas of `icha.planning.costs` were fitted to: seconds on one core, counts, bytes.

`python benchmarks/costs.py --fit` measures cases anew and writes their times into this file, by least squares of the
logarithms of expected over measured ones. For a faster solver, or another machine, nothing else has to change.
"""

from dataclasses import dataclass, field

MiB = 2**20


@dataclass(frozen=True)
class Workflow:
    """What a campaign takes beside its results."""

    start: float = 2.6
    """Until the first job: `icha run`, Snakemake, the plan; s."""
    planned: float = 0.0012
    """More for every file of the plan; s."""
    environment: float = 2
    """Imports of the process that jobs are forked from, once; s."""
    job: float = 0.17
    """What a job takes besides its work: scheduling, fork, log, checksums; s."""
    own_process: float = 1.5
    """More for a job that is no fork: its imports; s."""
    two_cores: float = 0.6
    """The part of its time that a job takes on two cores."""
    memory: float = 310 * MiB
    """Snakemake, `icha run` and the process that jobs are forked from; bytes."""
    program: float = 130 * MiB
    """A job that is no fork, before its work; bytes."""
    forked: float = 22 * MiB
    """A job that is a fork, before its work; bytes."""


@dataclass(frozen=True)
class Making:
    """Topographies."""

    file: float = 0.015
    """A surface file; s."""
    node: float = 2.4e-07
    """Spectral synthesis, statistics and file of a node; s."""


@dataclass(frozen=True)
class Loading:
    """Asperities on the way in."""

    run: float = 0.14
    """Dataset and file of a run; s."""
    node: float = 5.1e-09
    """Search of summits, for a node; s."""
    field: float = 3.8e-08
    """Gaps of a snapshot, for a node; s."""
    stop: float = 0.0084
    """A stop, without its spots; s."""
    spot: float = 6.5e-06
    """A spot at a stop; s."""
    event: float = 0.0012
    """A spot that has come into contact on the way; s."""
    crowd: float = 20000
    """Spots from which each takes the longer the more there are."""
    breadth: float = 0.5
    """The power of the number of summits of a hill with which spots take longer."""
    memory: float = 9 * MiB
    """What any run holds; bytes."""


@dataclass(frozen=True)
class Cycle:
    """Asperities on a way there and back."""

    way: float = 120
    """Equilibria of a way in and back where nothing jumps, at the usual longest step."""
    jumps: float = 48
    """Equilibria for the jumps of a spot with adhesion."""
    together: float = 0.96
    """The power of the number of spots with which those grow."""
    touches: float = 0.75
    """Equilibria for a spot without adhesion."""
    step: float = 0.006
    """An equilibrium; s."""
    spot: float = 3e-05
    """A spot of an equilibrium; s."""


@dataclass(frozen=True)
class Patches:
    """Boundary elements in the limit of a short range, on the way in."""

    stop: float = 7.6e-08
    """A stop without adhesion at p* = 0.01, over n^2 log2 n of n nodes a side; s."""
    load: float = 0.34
    """The power of the load with which a stop takes longer."""
    way: float = 3.7
    """The way to the first stop, in stops."""
    adhesion: float = 13
    """How much longer it all takes with adhesion of a strength of 0.01."""
    strength: float = 0.093
    """The power of that strength with which it does."""
    density: float = 0.6
    """The power of the number of summits in a cell, over 0.01, with which it does: noise makes small patches."""
    large: float = 0.6
    """The power of the nodes a side, over 2048, with which it does beyond that: of campaign cmc_truth, 8192 a side."""


@dataclass(frozen=True)
class PatchCycle:
    """Boundary elements on a way there and back, whose equilibria are counted as those of asperities."""

    step: float = 0.0036
    """An equilibrium; s."""
    cell: float = 8.2e-08
    """An equilibrium, over n^2 log2 n; s."""
    adhesion: float = 3.6
    """How much longer both take with adhesion."""


@dataclass(frozen=True)
class FiniteRange:
    """Boundary elements at finite ranges, by Tamaas."""

    run: float = 0.0032
    """Dataset and file; s."""
    bare: float = 4.8
    """A load on 512 nodes a side without adhesion, at p* = 0.01; s."""
    adhesive: float = 4.2
    """A load on 256 nodes a side with adhesion; s."""
    loop_step: float = 0.76
    """A step of a way there and back, in loads."""


@dataclass(frozen=True)
class Gathering:
    """What is made of finished runs."""

    theories: float = 0.28
    """Theories and literature of a surface; s."""
    table: float = 0.073
    """A file that holds something of every run; s."""
    dataset_run: float = 0.015
    """A run in the campaign dataset; s."""
    comparison_run: float = 0.003
    """A run in the comparison; s."""
    checks_run: float = 0.013
    """A run that is checked; s."""
    error_run: float = 0.05
    """A run or a solution that is compared with a run; s."""
    figure: float = 1.3
    """A figure as PNG and PDF; s."""
    figure_run: float = 0.007
    """A run of the studies that it shows; s."""
    map_node: float = 9.5e-08
    """A node of a topography that it shows; s."""
    report: float = 0.22
    """The report; s."""
    report_run: float = 0.01
    """A run in it; s."""
    report_figure: float = 0.014
    """A figure in it; s."""
    table_memory: float = 4 * MiB
    """What making a file of all runs takes, without their values; bytes."""
    blocks: float = 35 * MiB
    """Most that the dataset's job holds of the values of runs; bytes."""
    copies: float = 2.7
    """Memory that reading and using the dataset takes, over its arrays: chunks, decoded values and selected runs."""
    figure_memory: float = 85 * MiB
    """What drawing a figure takes; bytes."""
    report_memory: float = 18 * MiB
    """What writing the report takes; bytes."""


@dataclass(frozen=True)
class Constants:
    """All of them."""

    workflow: Workflow = field(default_factory=Workflow)
    making: Making = field(default_factory=Making)
    loading: Loading = field(default_factory=Loading)
    cycle: Cycle = field(default_factory=Cycle)
    patches: Patches = field(default_factory=Patches)
    patch_cycle: PatchCycle = field(default_factory=PatchCycle)
    finite_range: FiniteRange = field(default_factory=FiniteRange)
    gathering: Gathering = field(default_factory=Gathering)


FITTED = Constants()
