"""The pages of a campaign: the report and the page of `icha explore`; the table of the times of its jobs."""
