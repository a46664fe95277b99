"""Checks of one run: what it must satisfy, whichever model computed it."""
