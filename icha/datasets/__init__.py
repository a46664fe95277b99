"""What is kept: variables, attributes and netCDF files of surfaces, runs and campaigns."""
