"""Interacting asperities: equilibrium of all contact spots at a given separation, load or area, and its observables."""
