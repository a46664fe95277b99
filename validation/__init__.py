"""Comparisons of the models with closed forms, other codes and variants, for the documentation; not in the wheel."""
