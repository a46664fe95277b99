"""Every run ends: with results that pass their checks, with an error that names an argument, or with a reason.

Two thousand random cases, in twenty series: `make random-cases` computes them all.
Otherwise one series is (--series, the first if it is left out), of which `make test` takes the beginning.
"""

import re
import warnings
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from random_cases import Case, Topography, cases, lacking, refused, wrong

from icha import ConvergenceError, IchaWarning, Material, Path, SelfAffineSpectrum, simulate
from icha.boundary_elements.contact import BoundaryElements
from icha.equilibrium.interacting_asperities import InteractingAsperities

PERIOD = 100e-6
CASES_IN_SERIES = 100
# Number of loops with adhesion, which take seconds each; fifteen series have three hundred.
STICKY_LOOPS_IN_SERIES = 20
# Equilibria of one run, with those of its search for stops and events.
MOST_EQUILIBRIA = 20_000
# Smallest part of the cases of a series that completes; a third does.
COMPLETED = 0.1
# Text in the reason of a run that ended early.
ENDED = re.compile(r"after \d+ of \d+ stops|values of \w+ that are not finite")

# No equilibrium is found on unloading while nothing touches.
WITHOUT_A_SPOT_TO_LET_GO = Case(
    Topography("rough", grid=8, size=0.0, seed=0, period=PERIOD, height=1e-6, boundary="periodic"),
    (1e6, 0.07245618100960849, 1e-6),
    {"reduced_pressures": [3.1622776601683795e-05], "max_step": 0.5, "unload": True},
    "asperities",
)

# Where its area is asked for, a front jumps within its patch and the surfaces are farther apart than before.
FRONT_THAT_JUMPS_WITHIN_ITS_PATCH = Case(
    Topography("step", grid=9, size=0.0, seed=0, period=PERIOD, height=1e-6, boundary="periodic"),
    (1e6, 0.13863554287061428, 1e-6),
    {"area_fractions": [0.0016557699634695293, 0.01832314422371211], "max_step": 0.5, "unload": True},
    "boundary_elements",
)

# One step of loading is two steps of unloading.
LOOP_WITH_A_STEP_IN_TWO = Case(
    Topography("spike", grid=16, size=0.0, seed=0, period=PERIOD, height=1e-5, boundary="periodic"),
    (1e6, 0.0, 1e-9),
    {"mean_separations": [2.1289e-05], "max_step": 0.5, "snapshots": [("area_fraction", 0.02)], "unload": True},
    "boundary_elements",
)

# Contact is strongly unstable: of three asperities that may jump in, one stays. The others try again and again.
ONE_THAT_STAYS_OF_THREE = Case(
    Topography("pit", grid=9, size=0.45, seed=9, period=PERIOD, height=1e-6, boundary="periodic"),
    (1e6, 0.38176765449959826, 1e-6),
    {"mean_separations": [4e-6, 2.2873e-6], "max_step": 0.5, "snapshots": [], "unload": True},
    "asperities",
)

# Jumps in are uphill, as far as those off are downhill, and each is known as well as where it happens in its step.
UPHILL_AND_DOWNHILL = Case(
    Topography("noise", grid=16, size=0.0, seed=43, period=0.1, height=1e-3, boundary="periodic"),
    (1e6, 13.869572896740937, 0.00031622776601683794),
    {
        "area_fractions": [0.00019186687406702892, 0.00038018939632056124, 0.0010280162981264745],
        "max_step": 0.05,
        "snapshots": [("reduced_pressure", 0.003)],
        "unload": True,
        "turning_points": [("area_fraction", 0.001), ("area_fraction", 0.0010280162981264745)],
    },
    "asperities",
)

# The two spots of a union that has split overlap again during the iteration, at the largest tension.
PARTED_SPOTS_THAT_OVERLAP = Case(
    Topography("step", grid=8, size=0.3, seed=0, period=PERIOD, height=1e-6, boundary="periodic"),
    (1e6, 0.11231294684902415, 1e-6),
    {"mean_separations": [1.723e-6], "max_step": 0.5, "snapshots": None, "unload": True},
    "asperities",
)


def pytest_generate_tests(metafunc):
    """One test for each series."""
    if "series" in metafunc.fixturenames:
        metafunc.parametrize("series", metafunc.config.getoption("series"))


@pytest.fixture
def bounded(monkeypatch):
    """Counts equilibria, from each call of it on, and stops at too many."""
    calls = []

    def counted(original):
        def equilibrium(*arguments, **options):
            calls.append(1)
            assert len(calls) <= MOST_EQUILIBRIA, "the run does not end"
            return original(*arguments, **options)

        return equilibrium

    for model in (InteractingAsperities, BoundaryElements):
        monkeypatch.setattr(model, "equilibrium", counted(model.equilibrium))
    return calls.clear


@contextmanager
def only_check_warnings():
    """Every warning but those of ICHA itself is an error; `wrong` asserts the checks."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", IchaWarning)
        yield


def assert_ends(case):
    """Run a case and assert that its end is one of the three; return whether the path was completed."""
    try:
        with only_check_warnings():
            run = case.run()
        assert not lacking(case, run)
    except ConvergenceError as error:
        run, attrs = error.dataset, error.dataset.attrs
        assert (attrs["beyond_model"] if "beyond_model" in attrs else attrs["incomplete"]) == str(error)
        assert ENDED.search(str(error)), error
    except ValueError as error:
        assert refused(error), error
        return False
    assert not wrong(run)
    return "incomplete" not in run.attrs and "beyond_model" not in run.attrs


def test_odd_cases_end(bounded):
    for case in (FRONT_THAT_JUMPS_WITHIN_ITS_PATCH, LOOP_WITH_A_STEP_IN_TWO, ONE_THAT_STAYS_OF_THREE):
        assert_ends(case)
    assert_ends(PARTED_SPOTS_THAT_OVERLAP)


@pytest.mark.slow
@pytest.mark.parametrize("case", [WITHOUT_A_SPOT_TO_LET_GO, UPHILL_AND_DOWNHILL], ids=["without a spot", "uphill"])
def test_odd_cases_that_take_long_end(case, bounded):
    assert_ends(case)


@pytest.mark.hypothesis
def test_every_case_ends(series, bounded):
    completed = []

    @seed(series)
    @settings(max_examples=min(CASES_IN_SERIES, settings.default.max_examples // 3), derandomize=False)
    @given(cases())
    def ends(case):
        bounded()
        completed.append(assert_ends(case))

    ends()
    assert np.mean(completed) >= COMPLETED


@st.composite
def sticky_loops(draw):
    """A loop with the asperity model on a very small square, from no adhesion to sticky, for any Tabor parameter."""
    grid = draw(st.sampled_from([8, 10, 12]))
    spectrum = SelfAffineSpectrum(
        PERIOD, PERIOD, PERIOD / draw(st.floats(1.2, grid / 4)), draw(st.floats(0.1, 1.0)), 10 ** draw(st.floats(-2, 0))
    )
    surface = spectrum.realise(grid, draw(st.integers(0, 10**6)))
    modulus, strength, tabor = 1e6, draw(st.one_of(st.just(0.0), st.floats(-3, 0.3))), 10 ** draw(st.floats(-0.5, 1))
    energy = 10**strength * modulus * surface.rms_height**1.5 * surface.rms_curvature**0.5 if strength else 0.0
    range_ = np.cbrt((energy / modulus) ** 2 / surface.rms_curvature) / tabor if energy else 1e-9
    loads = [10 ** draw(st.floats(-4, -2.1)), 10 ** draw(st.floats(-2, -1))]
    path = Path(reduced_pressures=loads, unload=True, max_step=0.5, snapshots=[])
    return surface, Material(modulus, float(energy), float(range_)), path


def loss_and_rise(run):
    """Loss of a loop over its largest work, and largest rise of the separation in loading over h_rms.

    From separations, pressures and stiffnesses alone: the integral of the cubic through both ends of every step.
    """
    u, p, stiffness = (run[name].values for name in ("mean_separation", "nominal_pressure", "contact_stiffness"))
    width = np.diff(u)
    work = -np.cumsum(width * (p[1:] + p[:-1]) / 2 + width**2 * np.diff(stiffness) / 12)
    rise = np.max(np.diff(u[run["leg"].values == 0]), initial=0.0)
    return work[-1] / (np.max(np.abs(work)) or 1.0), rise / float(run["rms_height"])


@pytest.mark.hypothesis
def test_loops_that_gain_energy_or_move_apart_in_loading_are_marked(series):
    @seed(series)
    @settings(max_examples=min(STICKY_LOOPS_IN_SERIES, settings.default.max_examples // 8), derandomize=False)
    @given(sticky_loops())
    def are_marked(case):
        try:
            with only_check_warnings():
                run = simulate(*case)
        except (ConvergenceError, ValueError) as error:
            assert ENDED.search(str(error)) or refused(error) or "summit" in str(error), error
            return
        loss, rise = loss_and_rise(run)
        if loss < -1e-2 or rise > 1e-2:
            assert run.attrs["failed_checks"]
        assert not wrong(run)

    are_marked()


@pytest.mark.parametrize("strength", [1.0, 10.0])
def test_a_sticky_surface_is_called_sticky(strength):
    # More surface energy than it takes to press the summits flat.
    surface = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 8, 0.8, 0.2).realise(64, 1)
    modulus = 1e6
    energy = strength * modulus * surface.rms_height**1.5 * surface.rms_curvature**0.5
    range_ = np.cbrt((energy / modulus) ** 2 / surface.rms_curvature) / 3
    with pytest.raises(ConvergenceError, match="the surface is sticky") as caught:
        simulate(surface, Material(modulus, energy, range_), Path(reduced_pressures=[1e-3, 1e-2]))
    assert re.search(r"after 0 of 2 stops", str(caught.value))
    # Adhesion decides, not the solver.
    assert "sticky" in caught.value.dataset.attrs["beyond_model"]
