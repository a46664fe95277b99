"""What every model of a contact has: its interface, events, failures, and the bins of its distributions."""
