"""Make, verify, reproduce and upload deposits: published results with metadata, provenance and checksums."""
