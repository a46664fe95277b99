"""From results to a deposit: metadata, provenance, checksums; and back, from a deposit to the same results."""
