"""Plan a campaign before it runs: files, time, memory and expected validity."""
