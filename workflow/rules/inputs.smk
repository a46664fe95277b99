# The configuration as used, with copies of the files that it names.


rule configuration:
    input:
        as_it_is(list(COPIED.values())),
    output:
        FILES.configuration,
        list(COPIED),
    log:
        "<logs>/configuration.log",
    benchmark:
        "<benchmarks>/configuration.jsonl"
    conda:
        "../envs/icha.yaml"
    resources:
        mem_mb=200,
        runtime=2,
    params:
        # A dry run prints a checksum, not the text.
        text=as_it_is(LongList([CONFIG_TEXT])),
        # Copied files are compared by content, not by time.
        sha256=lambda wildcards: [sha256_of(Path(file)) for file in COPIED.values()],
        code=code_of("write_configuration.py"),
    message:
        "Writing the configuration as used"
    script:
        "../scripts/write_configuration.py"
