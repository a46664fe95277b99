"""The figures: every module turns datasets into one matplotlib figure and carries its caption."""
