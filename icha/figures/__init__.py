"""Figures of a campaign: one module for each figure, and modules of functions that all figures share."""
