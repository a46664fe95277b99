"""General tools without contact mechanics: safe writing of files, checksums, units, bounds of values, threads."""
