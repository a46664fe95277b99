"""What a campaign will compute and cost, before it does."""
