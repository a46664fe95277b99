"""Configuration files: keys and their meaning, reading and checks, and the runs of a campaign."""
