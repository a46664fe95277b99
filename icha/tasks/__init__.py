"""Tasks of a campaign: compute one surface, one run or the theories of one surface from settings, and write a file."""
