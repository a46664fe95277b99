"""Boundary elements on rough surfaces: against Tamaas, their symmetries, steps, energy, threads."""

import json
import os
import subprocess
import sys

import pytest

from icha.references.short_range.against_finite_range import towards_short_range, without_adhesion
from icha.references.short_range.rough_contacts import HARD, SOFT, by_cells_per_wave, by_steps, loop, rough, symmetries


def test_without_adhesion_they_are_those_of_tamaas():
    for row in without_adhesion(rough(96, 12), (2e-3, 3e-2)):
        assert abs(row["separation_error"]) <= 1e-3
        assert row["gap_error"] <= 1e-3
        assert abs(row["area_error"]) <= 5e-3


@pytest.mark.parametrize("material", [HARD, SOFT], ids=["hard", "adhesive"])
def test_surface_shifted_reflected_or_turned_has_the_same_contact(material):
    for row in symmetries(rough(64, 8), 2.0, material):
        assert abs(row["pressure_error"]) <= 1e-5 and abs(row["area_error"]) <= 1e-5
        assert row["fraction_error"] <= (1e-3 if material is SOFT else 0)


def test_a_stop_is_the_same_in_five_and_in_fifty_steps():
    few = by_steps(rough(64, 8), 2.0, (5, 50))[-1]
    assert few["steps"] == 5
    assert abs(few["pressure_error"]) <= 1e-6 and abs(few["area_error"]) <= 1e-6 and few["fraction_error"] <= 1e-4


def test_loop_without_adhesion_gives_all_work_back():
    """But for the error of the integral of the pressure, whose slope jumps with every cell that closes."""
    row = loop(rough(64, 8), 1e-2, 0.2, HARD)
    assert abs(row["work"]) <= 5e-4 * row["largest_work"]
    assert abs(row["not_closed"]) <= 1e-10 * row["largest_work"]


@pytest.mark.slow
def test_loop_with_adhesion_loses_what_its_events_lose_whatever_the_step():
    coarse, fine = (loop(rough(96, 12), 1e-2, step) for step in (0.2, 0.1))
    for row in (coarse, fine):
        assert row["work"] > 0
        assert abs(row["not_closed"]) <= 1e-6 * row["largest_work"]
    assert coarse["work"] == pytest.approx(fine["work"], rel=0.01)


def test_load_and_area_hardly_depend_on_the_grid():
    coarse, fine = by_cells_per_wave(12, (8, 16), (1.5,))
    assert coarse["reduced_pressure"] == pytest.approx(fine["reduced_pressure"], rel=0.005)
    assert coarse["area"] == pytest.approx(fine["area"], rel=0.01)


@pytest.mark.slow
def test_attraction_of_shorter_and_shorter_range_tends_to_the_limit():
    rows = towards_short_range(rough(96, 6, 16), (1.5,), ((800e-9, 1), (400e-9, 1)), 0.5)
    *finite, limit = rows
    for name in ("pressure", "energetic_area"):
        far, near = (abs(row[name] - limit[name]) for row in finite)
        assert near < far


def test_threads_change_no_byte():
    digests = set()
    for threads in ("1", "2"):
        environment = os.environ | {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        command = [sys.executable, "-m", "icha.references.short_range.rough_contacts", "64"]
        run = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
        digests.add(json.loads(run.stdout))
    assert len(digests) == 1
