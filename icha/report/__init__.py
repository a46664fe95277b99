"""The pages of a campaign: the report, the page of `icha explore`, and the times of the jobs."""
