"""Files, time and memory of a campaign before it runs."""
