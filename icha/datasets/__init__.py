"""Results as files: variables, attributes and netCDF files of surfaces, runs and campaigns."""
