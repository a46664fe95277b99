"""Equilibrium of all contact spots at a given separation, load or area, and what it shows."""
