"""Write and read results as netCDF files of surfaces, runs and campaigns, with described variables and attributes."""
