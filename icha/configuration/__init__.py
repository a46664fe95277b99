"""Read and check configuration files, explain their keys, and list the runs of a campaign."""
