# References for runs. The first rule writes theories and published data points. The other rules solve the contact of a
# run with boundary elements at a finite range of attraction: one rule at one load, one rule in a cycle of loading and
# unloading.

from icha.configuration.cases import adhesive_contacts, loop_settings, solution_settings
from icha.planning.requirements import solver_memory


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
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("make_references.py"),
    message:
        "Theories and literature for surface {wildcards.surface}"
    script:
        "../scripts/make_references.py"


rule boundary_elements:
    input:
        surface="<results>/surfaces/{surface}/seed{seed}.nc",
    output:
        "<results>/references/boundary_elements/{entry}/<contact>/p{pressure}.nc",
    log:
        "<logs>/boundary_elements/{entry}/<contact>/p{pressure}.log",
    benchmark:
        "<benchmarks>/boundary_elements/{entry}/<contact>/p{pressure}.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=lambda wildcards: solver_memory(CAMPAIGN, wildcards.surface, CAMPAIGN.finite_range[wildcards.entry]),
        runtime=240,
    params:
        settings=lambda wildcards: solution_settings(CAMPAIGN, labels_of(FILES.solutions, results.SOLUTION, wildcards)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("solve_boundary_elements.py"),
    message:
        "Boundary elements {wildcards.entry}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.material}, p* = {wildcards.pressure}"
    script:
        "../scripts/solve_boundary_elements.py"


rule boundary_element_loop:
    input:
        surface="<results>/surfaces/{surface}/seed{seed}.nc",
    output:
        "<results>/references/loops/{entry}/<contact>.nc",
    log:
        "<logs>/loops/{entry}/<contact>.log",
    benchmark:
        "<benchmarks>/loops/{entry}/<contact>.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=lambda wildcards: solver_memory(
            CAMPAIGN, wildcards.surface, CAMPAIGN.boundary_element_loops[wildcards.entry]
        ),
        runtime=480,
    params:
        settings=lambda wildcards: loop_settings(CAMPAIGN, labels_of(FILES.loops, results.LOOP, wildcards)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("follow_boundary_elements.py"),
    message:
        "Cycle with boundary elements {wildcards.entry}: {wildcards.surface}, seed {wildcards.seed}, "
        "slope {wildcards.slope}, {wildcards.material}"
    script:
        "../scripts/follow_boundary_elements.py"
