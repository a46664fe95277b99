"""The way from first contact to given loads, areas or separations, and back."""
