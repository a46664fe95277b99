# Topographies at rms slope 1, shared by all slopes and materials.

from icha.configuration.cases import surface_settings
from icha.planning.requirements import surface_memory, surface_threads


rule surface:
    input:
        unpack(
            lambda wildcards: (
                {"height_map": surface.path} if (surface := CAMPAIGN.surfaces[wildcards.surface]).from_file else {}
            )
        ),
    output:
        "<results>/surfaces/{surface}/seed{seed}.nc",
    log:
        "<logs>/surfaces/{surface}/seed{seed}.log",
    benchmark:
        "<benchmarks>/surfaces/{surface}/seed{seed}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: lambda wildcards: surface_threads(CAMPAIGN, wildcards.surface)
    resources:
        mem_mb=lambda wildcards: surface_memory(CAMPAIGN, wildcards.surface),
        runtime=30,
    params:
        settings=lambda wildcards: surface_settings(CAMPAIGN, wildcards.surface),
        # Files are compared by content, not by time.
        sha256=lambda wildcards: getattr(CAMPAIGN.topography(wildcards.surface), "sha256", None),
        attributes=lambda wildcards: ATTRIBUTES | STAMPS[f"{RESULTS}/{results.SURFACE}".format(**wildcards)],
        code=code_of("make_surface.py"),
    message:
        "Surface {wildcards.surface}, seed {wildcards.seed}"
    script:
        "../scripts/make_surface.py"
