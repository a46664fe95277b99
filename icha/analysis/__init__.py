"""What is made of finished runs: comparisons at common loads, the model's error, checks."""
