"""Configuration files: their model, how they are read, and the runs that they ask for."""
