"""HTML pages about a campaign (the report, the page of `icha explore`), and the table of the times of jobs."""
