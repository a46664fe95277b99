# One job for each run. Runs of other models than the asperity model are in a folder with the name of the model.

from icha.configuration.cases import run_settings
from icha.contact.models import MODELS
from icha.datasets.labels import model_folder
from icha.planning.requirements import run_memory, run_minutes, surface_threads


wildcard_constraints:
    model_folder="|".join(map(model_folder, MODELS)),


# Snakemake needs the settings of each run several times, for up to ten thousand runs.
SETTINGS_OF_RUN = cache(lambda case: run_settings(CAMPAIGN, case))

# Each model has its own fingerprint, because the script imports the module of the model.
CODE_OF_RUN = {name: code_of("run_sweep.py", model.module) for name, model in MODELS.items()}


rule run:
    input:
        surface="<results>/surfaces/{surface}/seed{seed}.nc",
    output:
        "<results>/runs/<run>.nc",
    log:
        "<logs>/runs/<run>.log",
    benchmark:
        "<benchmarks>/runs/<run>.jsonl"
    # Long runs start first; otherwise, at the end, one long run could occupy one core while other cores are idle.
    priority: by_case(lambda case: int(MODELS[case.model].resumable))
    conda:
        "../envs/icha.yaml"
    threads: by_case(lambda case: surface_threads(CAMPAIGN, case.surface))
    resources:
        mem_mb=by_case(lambda case: run_memory(CAMPAIGN, case)),
        runtime=by_case(lambda case: run_minutes(CAMPAIGN, case)),
    params:
        settings=lambda wildcards: SETTINGS_OF_RUN(case_of(wildcards)),
        attributes=lambda wildcards: ATTRIBUTES
        | {"study": wildcards.study}
        | STAMPS[f"{RESULTS}/{results.RUN}".format(**wildcards)],
        code=by_case(lambda case: CODE_OF_RUN[case.model]),
        # A run that takes hours can be resumed from checkpoints.
        resumable=by_case(lambda case: MODELS[case.model].resumable and surface_threads(CAMPAIGN, case.surface) > 1),
    message:
        "Sweep {wildcards.study}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.model_folder}{wildcards.material}"
    script:
        "../scripts/run_sweep.py"
