"""compliance-checker, quicker: what it finds out about a file over and over, for every variable anew, is remembered.

It asks some thousand times which variables of a file are coordinates, times or axes, each time going through all of
them. The files are not changed meanwhile, so that the answers, and what the checker says, stay the same.
"""

from __future__ import annotations

import copy
import functools

from compliance_checker.cf import util

ASKED = (
    "get_auxiliary_coordinate_variables",
    "get_axis_variables",
    "get_cell_boundary_variables",
    "get_climatology_variable",
    "get_coordinate_variables",
    "get_geophysical_variables",
    "get_latitude_variables",
    "get_longitude_variables",
    "get_time_variable",
    "get_time_variables",
    "get_z_variables",
)


def remember() -> None:
    """Remember the answers of these functions, once for each file."""
    for name in ASKED:
        asked = getattr(util, name)
        if not hasattr(asked, "__wrapped__"):
            setattr(util, name, _remembered(asked))


def _remembered(asked):
    answers = {}

    @functools.wraps(asked)
    def answer(data):
        # The file is kept, too, so that no other one can have its id.
        if id(data) not in answers:
            answers[id(data)] = data, asked(data)
        return copy.copy(answers[id(data)][1])

    return answer
