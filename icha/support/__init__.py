"""General tools without contact mechanics: atomic files, checksums, units, rules for values, cores."""
