"""The pages of a campaign: report, page for exploring, times of the jobs."""
