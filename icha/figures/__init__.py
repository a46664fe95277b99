"""Draw the figures of a campaign: one module for each figure, and modules with functions for all figures."""
