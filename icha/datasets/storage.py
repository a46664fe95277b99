"""How arrays are stored: which of them are compressed, and how."""

# As measured by benchmarks/storage.py (docs/reference/dataset.md): smaller arrays lose by being cut into chunks what
# compression gains.
LEAST_COMPRESSED = 1024
# Larger arrays are heights: a fifth less space would take 13 s for 8192 nodes a side.
COMPRESSED_SIZES = range(LEAST_COMPRESSED, 2**22)
COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True}

# Bytes of an array of a campaign dataset beyond which it is not read as a whole.
LEFT_IN_FILE = 2**26
