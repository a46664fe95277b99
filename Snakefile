# ICHA: adhesive rough contact with interacting and coalescing asperities.
# One configuration file describes one campaign: config/config.yaml, or the file of --configfile. See config/README.md.

import gc
import os
import shlex
import sys

# Files in this folder or in the working directory must not replace modules, unless PYTHONPATH names these folders.
ROOT = str(workflow.current_basedir)
LOCAL_FOLDERS = {os.path.realpath(ROOT), os.path.realpath("")}
REQUESTED = os.environ.get("PYTHONPATH", "").split(os.pathsep)
sys.path.sort(key=lambda folder: os.path.realpath(folder) in LOCAL_FOLDERS and folder not in filter(None, REQUESTED))

from snakemake.utils import min_version

min_version("9.17")

# Modules of jobs cannot be replaced either. Snakemake inserts the path of Python into shell commands without quotes.
os.environ.update(PYTHONSAFEPATH="1")
sys.executable = shlex.quote(sys.executable)

# Snakemake makes many objects for each file and removes few, so looking for garbage would take a sixth of the time.
gc.set_threshold(50_000)


include: "workflow/rules/common.smk"


# The stamp of a file decides whether the file is valid. Snakemake computes missing files, so outdated files are removed.
if workflow.is_main_process:
    needed = needed_files(FILES, prepare.targets_of(sys.argv))
    stamps = {path: stamp for path, stamp in STAMPS.items() if path in needed}
    campaign = prepare.Results(RESULTS, CONFIGURATION.origin, stamps, dry_run=workflow.output_settings.dryrun)


include: "workflow/rules/inputs.smk"
include: "workflow/rules/runs.smk"
include: "workflow/rules/analysis.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/publish.smk"


onstart:
    campaign.begin()


# Remove temporary files of jobs that were killed during this call. The next call may have no jobs.
onsuccess:
    campaign.remove_left_over()


onerror:
    campaign.remove_left_over()


# On a cluster, these short jobs and targets run beside Snakemake and are not submitted.
localrules:
    all,
    surfaces,
    runs,
    references,
    dataset,
    figures,
    report,
    publish,
    configuration,
    analyse,
    verdict,
    report_page,
    deposit,


# Snakemake does not miss the input of a job that need not run. So targets name all surfaces and runs that have been lost
# since the analysis.
LOST = [path for path in STAMPS if os.path.exists(FILES.dataset) and not os.path.exists(path)]


rule all:
    default_target: True
    input:
        FILES.configuration,
        list(COPIED),
        as_outputs(LOST),
        FILES.analysed,
        FILES.verdict,
        FILES.checksums,
        FILES.figures,
        FILES.report,


rule surfaces:
    input:
        as_it_is(list(FILES.surfaces)),


rule runs:
    input:
        as_it_is([*FILES.surfaces, *FILES.runs]),


rule references:
    input:
        as_it_is([*FILES.surfaces, *FILES.theories]),


rule dataset:
    input:
        as_outputs(LOST),
        FILES.analysed,
        FILES.verdict,
        FILES.checksums,


rule figures:
    input:
        FILES.figures,


rule report:
    input:
        as_outputs(LOST),
        FILES.report,


rule publish:
    input:
        rules.all.input,
        f"{FILES.deposit}/SHA256SUMS",
        f"{FILES.deposit}.zip",
