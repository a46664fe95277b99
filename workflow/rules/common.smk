# What all rules share: the campaign, the names of its results, and the fingerprints of the code.

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir, "workflow")))

import before_jobs
from command_line import campaign_configuration
from fingerprint import code_fingerprint
from publishable import refuse_unpublishable

from icha.configuration.cases import asperity_cases, loop_cases, run_cases, solution_cases, source_cases, surface_cases
from icha.configuration.settings import campaign_sha256, loop_settings, run_settings, run_sha256, solution_settings, source_settings, surface_settings
from icha.configuration.named_files import with_files_beside_it
from icha.planning.costs import job_threads
from icha.publication.attributes import discovery_attributes
from icha.publication.source import committed_source

CONFIGURATION = campaign_configuration(workflow)
CAMPAIGN = CONFIGURATION.campaign
CASES = {f"{case.path}.nc": case for case in run_cases(CAMPAIGN)}
LABELS = [tuple(case) for case in CASES.values()]

RESULTS = f"results/{CAMPAIGN.name}"
LOGS = f"{RESULTS}/logs"
BENCHMARKS = f"{RESULTS}/benchmarks"
CONFIG_USED = f"{RESULTS}/config.used.yaml"
# The configuration is kept with copies of the files that it names (of a kept configuration, they are there).
CONFIG_TEXT, NAMED_FILES = with_files_beside_it(CONFIGURATION)
INPUTS = {f"{RESULTS}/{place}": file for place, file in NAMED_FILES.items()}
COPIED = {copy: file for copy, file in INPUTS.items() if Path(copy).resolve() != Path(file).resolve()}
SURFACES = [f"{RESULTS}/surfaces/{name}/seed{seed}.nc" for name, seed in surface_cases(CAMPAIGN)]
RUNS = [f"{RESULTS}/runs/{path}" for path in CASES]
THEORIES = [f"{RESULTS}/references/{name}.nc" for name in dict.fromkeys(name for name, _ in surface_cases(CAMPAIGN))]
SOLUTION_CASES = {f"{case.path}.nc": case for case in solution_cases(CAMPAIGN)}
SOLUTION_LABELS = [tuple(case) for case in SOLUTION_CASES.values()]
SOLUTIONS = [f"{RESULTS}/references/boundary_elements/{path}" for path in SOLUTION_CASES]
SOURCE_CASES = {f"{case.path}.nc": case for case in source_cases(CAMPAIGN)}
ERROR_SOURCES = [f"{RESULTS}/references/error_sources/{path}" for path in SOURCE_CASES]
LOOP_CASES = {f"{case.path}.nc": case for case in loop_cases(CAMPAIGN)}
LOOPS = [f"{RESULTS}/references/loops/{path}" for path in LOOP_CASES]
ASPERITIES = [f"{RESULTS}/references/one_asperity/{name}.nc" for name in asperity_cases(CAMPAIGN)]
REFERENCES = [*THEORIES, *SOLUTIONS, *LOOPS, *ERROR_SOURCES, *ASPERITIES]
DATASET = f"{RESULTS}/dataset/{CAMPAIGN.name}.nc"
COMPARISON = f"{RESULTS}/aggregated/{CAMPAIGN.name}.nc"
# Only a campaign with boundary elements has an error to tell.
MODEL_ERROR = [f"{RESULTS}/aggregated/model_error.nc"] if SOLUTIONS else []
CHECKS = f"{RESULTS}/checks.json"
VERDICT = f"{RESULTS}/verdict.txt"
FIGURES = [f"{RESULTS}/figures/{name}.{ending}" for name in CAMPAIGN.figures.drawn() for ending in ("png", "pdf")]
REPORT = f"{RESULTS}/report.html"
RUN_TIMES = f"{RESULTS}/run_times.tsv"
PUBLICATION = CAMPAIGN.published()
# Without a version nothing is made: see publish.smk.
DEPOSIT = f"{RESULTS}/publish/{CAMPAIGN.name}-{PUBLICATION.version or 'without_version'}"


# Attributes of every dataset of the campaign, but for its `id`, which is its path (see workflow/scripts/job.py).
ATTRIBUTES = {"campaign": CAMPAIGN.name, "license": PUBLICATION.license}


wildcard_constraints:
    entry="[a-z0-9_-]+",
    asperity="hertz|mu[0-9.]+",
    study="[a-z0-9_-]+",
    surface="[A-Za-z0-9_.+-]+",
    seed=r"\d+",
    slope=r"[0-9.e+-]+",
    pressure=r"[0-9.e+-]+",
    material="[A-Za-z0-9_.+-]+",


def as_it_is(value):
    """A value as a parameter of a rule: what users have written may hold braces, which are no wildcards."""
    return lambda wildcards: value


def code_of(script, *modules):
    """Fingerprint of a script of workflow/scripts and of what it imports, as a parameter of its rule."""
    return code_fingerprint(Path(workflow.basedir, "workflow/scripts", script), *modules)


def height_map(wildcards):
    """The file of a surface that is not made at random."""
    surface = CAMPAIGN.surfaces[wildcards.surface]
    return {} if surface.random else {"height_map": surface.path}


def points_of(surface):
    """Nodes of a surface's grid."""
    return CAMPAIGN.grid(surface) ** 2


def memory_of(surface):
    """Megabytes that making a surface, or a sweep of it, needs: some arrays of its size, and the program."""
    return 600 + 4 * 8 * points_of(surface) // 10**6


def threads_of(surface):
    """Cores for a surface and its sweeps: one, with sweeps side by side, but where transforms of large arrays pay."""
    return job_threads(CAMPAIGN.grid(surface))


def minutes_of(wildcards):
    """Minutes after which a sweep is taken for stuck: many times what such sweeps have taken."""
    if threads_of(wildcards.surface) > 1:
        return 240
    study = CAMPAIGN.studies[wildcards.study]
    return 120 if study.unload or study.turning_points else 30


def solution_of(wildcards):
    return SOLUTION_CASES["{entry}/{surface}/seed{seed}/slope{slope}/{material}/p{pressure}.nc".format(**wildcards)]


def sources_of(wildcards):
    return SOURCE_CASES["{entry}/{surface}/seed{seed}/slope{slope}/{material}.nc".format(**wildcards)]


def loop_of(wildcards):
    return LOOP_CASES["{entry}/{surface}/seed{seed}/slope{slope}/{material}.nc".format(**wildcards)]


def solution_memory(surface, entry):
    """Megabytes that boundary elements need: some thirty arrays of their grid, and the program."""
    return 400 + 30 * 8 * points_of(surface) * entry.refinement**2 // 10**6


def adhesive_contacts(surface):
    """Slopes and materials with adhesion of a surface's runs, each once."""
    materials = {name: material.model_dump() for name, material in CAMPAIGN.materials.items()}
    pairs = dict.fromkeys((case.rms_slope, case.material) for case in CASES.values() if case.surface == surface)
    return [
        {"rms_slope": rms_slope, "name": name, "material": materials[name]}
        for rms_slope, name in pairs
        if materials[name]["surface_energy"] > 0
    ]


def case_of(wildcards):
    return CASES["{study}/{surface}/seed{seed}/slope{slope}/{material}.nc".format(**wildcards)]


def settings_of(wildcards):
    return run_settings(CAMPAIGN, case_of(wildcards))


def what_is_published(wildcards):
    """The files of a deposit; ends the program where there can be none, before anything is computed."""
    refuse_unpublishable(CONFIGURATION, workflow.basedir)
    return [
        CONFIG_USED,
        *INPUTS,
        DATASET,
        COMPARISON,
        CHECKS,
        VERDICT,
        REPORT,
        *FIGURES,
        *SURFACES,
        *RUNS,
        *REFERENCES,
        *MODEL_ERROR,
    ]
