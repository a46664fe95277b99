"""The vocabulary of all files: dimensions, units, long name and type of every variable, file by file."""
