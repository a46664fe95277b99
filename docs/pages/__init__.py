"""Pages of the documentation whose numbers are results: Markdown, written from datasets."""
