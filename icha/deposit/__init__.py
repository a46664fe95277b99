"""Make deposits of results, with metadata, provenance and checksums; verify, reproduce and upload deposits."""
