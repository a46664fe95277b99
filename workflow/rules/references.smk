# references/<surface>.nc: what theories say of a surface, and published points;
# references/boundary_elements/<entry>/<surface>/seed<k>/slope<g>/<material>/p<p*>.nc: one load each, by boundary
# elements on the topography of the run;
# references/loops/<entry>/<surface>/seed<k>/slope<g>/<material>.nc: boundary elements both ways;
# references/error_sources/<entry>/<surface>/seed<k>/slope<g>/<material>.nc: variants between the model and them;
# references/one_asperity/<hertz or mu<mu>>.nc: where the answer is known.


rule reference:
    input:
        surface=lambda wildcards: next(
            f"{RESULTS}/surfaces/{name}/seed{seed}.nc"
            for name, seed in surface_cases(CAMPAIGN)
            if name == wildcards.surface
        ),
    output:
        f"{RESULTS}/references/{{surface}}.nc",
    log:
        f"{LOGS}/references/{{surface}}.log",
    benchmark:
        f"{BENCHMARKS}/references/{{surface}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=600,
        runtime=10,
    params:
        settings=lambda wildcards: surface_settings(CAMPAIGN, wildcards.surface),
        adhesive=lambda wildcards: adhesive_contacts(wildcards.surface),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("make_references.py"),
    message:
        "Theories and literature for surface {wildcards.surface}"
    script:
        "../scripts/make_references.py"


rule boundary_elements:
    input:
        surface=f"{RESULTS}/surfaces/{{surface}}/seed{{seed}}.nc",
    output:
        f"{RESULTS}/references/boundary_elements/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}/p{{pressure}}.nc",
    log:
        f"{LOGS}/boundary_elements/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}/p{{pressure}}.log",
    benchmark:
        f"{BENCHMARKS}/boundary_elements/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}/p{{pressure}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=lambda wildcards: solution_memory(wildcards.surface, CAMPAIGN.boundary_elements[wildcards.entry]),
        runtime=240,
    params:
        settings=lambda wildcards: solution_settings(CAMPAIGN, solution_of(wildcards)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("solve_boundary_elements.py"),
    message:
        "Boundary elements {wildcards.entry}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.material}, p* = {wildcards.pressure}"
    script:
        "../scripts/solve_boundary_elements.py"


rule boundary_element_loop:
    input:
        surface=f"{RESULTS}/surfaces/{{surface}}/seed{{seed}}.nc",
    output:
        f"{RESULTS}/references/loops/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.nc",
    log:
        f"{LOGS}/loops/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/loops/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=lambda wildcards: solution_memory(wildcards.surface, CAMPAIGN.boundary_element_loops[wildcards.entry]),
        runtime=480,
    params:
        settings=lambda wildcards: loop_settings(CAMPAIGN, loop_of(wildcards)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("follow_boundary_elements.py"),
    message:
        "Boundary elements both ways {wildcards.entry}: {wildcards.surface}, seed {wildcards.seed}, "
        "slope {wildcards.slope}, {wildcards.material}"
    script:
        "../scripts/follow_boundary_elements.py"


rule error_sources:
    input:
        surface=f"{RESULTS}/surfaces/{{surface}}/seed{{seed}}.nc",
    output:
        f"{RESULTS}/references/error_sources/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.nc",
    log:
        f"{LOGS}/error_sources/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/error_sources/{{entry}}/{{surface}}/seed{{seed}}/slope{{slope}}/{{material}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=lambda wildcards: solution_memory(wildcards.surface, CAMPAIGN.error_sources[wildcards.entry]),
        runtime=480,
    params:
        settings=lambda wildcards: source_settings(CAMPAIGN, sources_of(wildcards)),
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("find_error_sources.py"),
    message:
        "Sources of the error {wildcards.entry}: {wildcards.surface}, seed {wildcards.seed}, slope {wildcards.slope}, "
        "{wildcards.material}"
    script:
        "../scripts/find_error_sources.py"


rule one_asperity:
    output:
        f"{RESULTS}/references/one_asperity/{{asperity}}.nc",
    log:
        f"{LOGS}/one_asperity/{{asperity}}.log",
    benchmark:
        f"{BENCHMARKS}/one_asperity/{{asperity}}.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=800,
        runtime=120,
    params:
        tabor_parameter=lambda wildcards: asperity_cases(CAMPAIGN)[wildcards.asperity],
        attributes=as_it_is(ATTRIBUTES),
        code=code_of("press_one_asperity.py"),
    message:
        "One asperity: {wildcards.asperity}"
    script:
        "../scripts/press_one_asperity.py"
