"""Events: jumps into and out of contact, unions, their undoing, and contacts taken in by others; one module each."""
