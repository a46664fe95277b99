# Theories and published data points for each surface.

from icha.configuration.cases import adhesive_contacts


rule reference:
    input:
        surface=lambda wildcards: next(
            file for file, (surface, _) in FILES.surfaces.items() if surface == wildcards.surface
        ),
    output:
        "<results>/references/{surface}.nc",
    log:
        "<logs>/references/{surface}.log",
    benchmark:
        "<benchmarks>/references/{surface}.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=600,
        runtime=10,
    params:
        settings=lambda wildcards: surface_settings(CAMPAIGN, wildcards.surface),
        adhesive=lambda wildcards: adhesive_contacts(CAMPAIGN, wildcards.surface),
        attributes=lambda wildcards: ATTRIBUTES | STAMPS[f"{RESULTS}/{results.THEORIES}".format(**wildcards)],
        code=code_of("make_references.py"),
    message:
        "Theories and literature for surface {wildcards.surface}"
    script:
        "../scripts/make_references.py"
