# What all rules share: the campaign, its files, and how parameters are written.

import os
import sys
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(ROOT, "workflow")))

import before_jobs
from command_line import campaign_configuration
from fingerprint import code_fingerprint

from icha.configuration.load import with_files_beside_it
from icha.configuration.cases import run_sha256
from icha.datasets import results
from icha.planning.results import campaign_files

before_jobs.plan_without_collecting()

CONFIGURATION = campaign_configuration(workflow, ROOT)
CAMPAIGN = CONFIGURATION.campaign
PUBLICATION = CAMPAIGN.published()
RESULTS = f"results/{CAMPAIGN.name}"
# All results, and what each of them holds.
FILES = campaign_files(CAMPAIGN, RESULTS)

# The configuration is kept with copies of the files that it names (of a kept configuration, they are there).
CONFIG_TEXT, NAMED_FILES = with_files_beside_it(CONFIGURATION)
INPUTS = {f"{RESULTS}/{place}": file for place, file in NAMED_FILES.items()}
COPIED = {copy: file for copy, file in INPUTS.items() if Path(copy).resolve() != Path(file).resolve()}

# Checksum of what determines a run, by its labels.
SHA256_OF_RUN = cache(lambda case: run_sha256(CAMPAIGN, case))

# Attributes of every dataset of the campaign, but for its `id`, which is its path (see workflow/scripts/job.py).
ATTRIBUTES = {"campaign": CAMPAIGN.name, "license": PUBLICATION.license}


pathvars:
    results=RESULTS,
    logs=f"{RESULTS}/logs",
    benchmarks=f"{RESULTS}/benchmarks",
    # One surface pressed against one material.
    contact="{surface}/seed{seed}/slope{slope}/{material}",
    # The same in a study, by a model.
    run="{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}",


wildcard_constraints:
    entry="[a-z0-9_-]+",
    asperity="hertz|mu[0-9.]+",
    study="[a-z0-9_-]+",
    surface="[A-Za-z0-9_.+-]+",
    seed=r"\d+",
    slope=r"[0-9.e+-]+",
    pressure=r"[0-9.e+-]+",
    material="[A-Za-z0-9_.+-]+",


def held(files, pattern, wildcards):
    """What one of `files` holds, by the wildcards of its path."""
    return files[f"{RESULTS}/{pattern}".format(**wildcards)]


def case_of(wildcards):
    """The labels of a run."""
    return held(FILES.runs, results.RUN, wildcards)


def by_case(value):
    """What `value` says of the case of a run, as a function of its wildcards.

    Where it is the same for all runs, it itself: Snakemake calls no function for each of ten thousand runs.
    """
    found = {value(case) for case in FILES.runs.values()}
    return found.pop() if len(found) == 1 else lambda wildcards: value(case_of(wildcards))


def as_it_is(value):
    """A value as a parameter of a rule: what users have written may hold braces, which are no wildcards."""
    return lambda wildcards: value


@cache
def code_of(script, *modules):
    """Fingerprint of a script of workflow/scripts and of what it imports, as a parameter of its rule."""
    return code_fingerprint(Path(ROOT, "workflow/scripts", script), *modules)
