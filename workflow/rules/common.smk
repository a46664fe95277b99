# Shared by all rules: the campaign, its files and batches, and functions for parameters.

import os
import sys
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(ROOT, "workflow")))

import prepare

from icha.configuration.cases import adhesive_contacts, run_settings, surface_settings
from icha.configuration.load import collect_inputs
from icha.datasets.results import SURFACE
from icha.planning.batches import is_resumable, run_batches, surface_batches, theory_batches
from icha.planning.results import campaign_files, expected_stamps, needed_files
from icha.support.checksums import LongList, sha256_of
from icha.support.fingerprint import fingerprint

CONFIGURATION = prepare.read_configuration(workflow, ROOT)
CAMPAIGN = CONFIGURATION.campaign
PUBLICATION = CAMPAIGN.deposit_metadata()
RESULTS = f"results/{CAMPAIGN.name}"
# All results with their labels, and the expected stamps of surfaces, runs and theories (icha/datasets/stamp.py).
FILES = campaign_files(CAMPAIGN, RESULTS)
STAMPS = expected_stamps(CAMPAIGN, RESULTS)

# Files that the configuration names are copied to the folder of the configuration as used.
CONFIG_TEXT, NAMED_FILES = collect_inputs(CONFIGURATION)
INPUTS = {f"{RESULTS}/{place}": file for place, file in NAMED_FILES.items()}
COPIED = {copy: file for copy, file in INPUTS.items() if Path(copy).resolve() != Path(file).resolve()}

# The surface file from which the theories of a surface are computed, by the name of the surface.
FIRST_SURFACES = dict(reversed([(name, path) for path, (name, _) in FILES.surfaces.items()]))

# Outputs of the rules of batches, by path.
MADE = {}

# The jobs of batches read the licence from Snakemake's `config`, which is no parameter of a job, because a new licence
# computes nothing again (workflow/prepare.py).
config["license"] = PUBLICATION.license


pathvars:
    results=RESULTS,
    logs=f"{RESULTS}/logs",
    benchmarks=f"{RESULTS}/benchmarks",


def attributes_of(path):
    """Return the attributes of a surface, run or file of theories, without the licence."""
    return {"campaign": CAMPAIGN.name} | {name: text for name, text in STAMPS[path].items() if name != "license"}


def surface_arguments(path):
    """Return the arguments of the task that makes a surface."""
    name, seed = FILES.surfaces[path]
    section, topography = CAMPAIGN.surfaces[name], CAMPAIGN.topographies.get(name)
    return {
        "name": name,
        "seed": seed,
        "settings": surface_settings(CAMPAIGN, name),
        "height_map": section.path if section.from_file else None,
        "sha256": getattr(topography, "sha256", None),
        "attributes": attributes_of(path),
    }


def theory_arguments(path):
    """Return the arguments of the task that computes the theories of a surface."""
    name = FILES.theories[path]
    return {
        "surface": FIRST_SURFACES[name],
        "settings": surface_settings(CAMPAIGN, name),
        "adhesive": adhesive_contacts(CAMPAIGN, name),
        "attributes": attributes_of(path),
    }


def surface_of(case):
    """Return the path of the surface of a run."""
    return f"{RESULTS}/{SURFACE}".format(surface=case.surface, seed=case.seed)


def run_arguments(path):
    """Return the arguments of the task that computes a run."""
    case = FILES.runs[path]
    return run_settings(CAMPAIGN, case) | {
        "surface": surface_of(case),
        "attributes": attributes_of(path) | {"study": case.study},
        "resumable": is_resumable(CAMPAIGN, case),
    }


def surfaces_for(runs):
    """Return the surfaces of runs or theories that do not exist yet, from the path of the surface by path of the result.

    A batch keeps files that exist, so it does not depend on their surfaces. Otherwise, a batch of surfaces that gets a
    new seed would start all jobs that use its other seeds.
    """
    return as_outputs(dict.fromkeys(surface for path, surface in runs.items() if not os.path.exists(path)))


def as_outputs(paths):
    """Return paths as outputs of the rules that make them, so that Snakemake need not compare paths with all rules."""
    return [MADE.get(path, path) for path in paths]


def as_it_is(value):
    """Return a value as a parameter of a rule, so that Snakemake does not read braces in texts as wildcards."""
    return lambda wildcards: value


def code_of(script, *modules):
    """Return the fingerprint of a script, of modules, and of all modules that these import, as a parameter of a rule."""
    return fingerprint(*modules, script=Path(ROOT, "workflow/scripts", script))
