# publish/: everything that a reader needs, with checksums. The list of checksums is written last.


rule deposit:
    input:
        [CONFIG_USED, DATASET, COMPARISON, CHECKS, VERDICT, REPORT],
        FIGURES,
        SURFACES,
        RUNS,
        REFERENCES,
        MODEL_ERROR,
    output:
        DEPOSIT,
    log:
        f"{LOGS}/publish.log",
    benchmark:
        f"{BENCHMARKS}/publish.jsonl"
    conda:
        "../envs/icha.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=30,
    params:
        title=CAMPAIGN.title,
        summary=CAMPAIGN.summary,
        license=CAMPAIGN.license,
        authors=[author.model_dump(exclude_none=True) for author in CAMPAIGN.authors],
        code=code_of("publish.py"),
    message:
        "Deposit"
    script:
        "../scripts/publish.py"
