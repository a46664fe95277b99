"""Interface of contact models: states, events, errors, bins of distributions, and checkpoints."""
