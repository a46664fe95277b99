"""The campaign dataset, written run by run: they are taken in, arranged, given a place in the file, written."""
