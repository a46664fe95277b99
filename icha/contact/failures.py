"""Failures of a search for equilibrium."""


class NotConverged(Exception):
    """An equilibrium was not found; the message says what happened."""


class FullContact(NotConverged):
    """The contact spread over the whole surface."""
