"""What every stage uses and nothing of contact mechanics: whole files, checksums, units, rules for values, cores."""
