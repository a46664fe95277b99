# Shared by all rules: the campaign, its files, and functions for parameters.

import os
import sys
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(ROOT, "workflow")))

import before_jobs
from command_line import campaign_configuration
from fingerprint import code_fingerprint

from icha.configuration.load import collect_inputs
from icha.configuration.cases import run_sha256
from icha.datasets import results
from icha.planning.results import campaign_files, expected_stamps

before_jobs.plan_without_collecting()

CONFIGURATION = campaign_configuration(workflow, ROOT)
CAMPAIGN = CONFIGURATION.campaign
PUBLICATION = CAMPAIGN.deposit_metadata()
RESULTS = f"results/{CAMPAIGN.name}"
# All results with their labels.
FILES = campaign_files(CAMPAIGN, RESULTS)
STAMPS = expected_stamps(CAMPAIGN, RESULTS)

# Files that the configuration names are copied to the folder of the configuration as used.
CONFIG_TEXT, NAMED_FILES = collect_inputs(CONFIGURATION)
INPUTS = {f"{RESULTS}/{place}": file for place, file in NAMED_FILES.items()}
COPIED = {copy: file for copy, file in INPUTS.items() if Path(copy).resolve() != Path(file).resolve()}

# Function that returns the checksum of the settings of a run with given labels.
SHA256_OF_RUN = cache(lambda case: run_sha256(CAMPAIGN, case))

# Attributes of every dataset; workflow/scripts/job.py adds the attribute `id`, the path of the dataset.
ATTRIBUTES = {"campaign": CAMPAIGN.name, "license": PUBLICATION.license}


pathvars:
    results=RESULTS,
    logs=f"{RESULTS}/logs",
    benchmarks=f"{RESULTS}/benchmarks",
    # One run: one surface against one material in a study, with one model.
    run="{study}/{surface}/seed{seed}/slope{slope}/{model_folder}{material}",


wildcard_constraints:
    study="[a-z0-9_-]+",
    surface="[A-Za-z0-9_.+-]+",
    seed=r"\d+",
    slope=r"[0-9.e+-]+",
    material="[A-Za-z0-9_.+-]+",


def case_of(wildcards):
    """Return the labels of the run with given wildcards."""
    return FILES.runs[f"{RESULTS}/{results.RUN}".format(**wildcards)]


def by_case(value):
    """Return a function that finds the labels of a run by its wildcards, and returns `value` of these labels.

    If all runs have the same value, return this value, because Snakemake would call the function for every run.
    """
    values = {value(case) for case in FILES.runs.values()}
    return values.pop() if len(values) == 1 else lambda wildcards: value(case_of(wildcards))


def as_it_is(value):
    """Return a value as a parameter of a rule, so that Snakemake does not read braces in texts as wildcards."""
    return lambda wildcards: value


@cache
def code_of(script, *modules):
    """Return the fingerprint of a script and of the modules that it imports, as a parameter of its rule."""
    return code_fingerprint(Path(ROOT, "workflow/scripts", script), *modules)
