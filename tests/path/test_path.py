"""The loading path: stops hit exactly, refused when they cannot be meant, and independence of the step."""

import numpy as np
import pytest

from icha import ConvergenceError, Material, Path, SelfAffineSpectrum, Surface, simulate
from icha.asperity.jkr import JKR
from icha.checks.run import check_run
from icha.contact.model import NotConverged
from icha.contact.models import RESIDUAL_TOLERANCE
from icha.equilibrium.interacting_asperities import InteractingAsperities, contact_of
from icha.path.follow import follow
from icha.references.indentation import sphere_pull_off
from icha.surfaces.summits import find_summits

PERIOD, MODULUS = 100e-6, 25e6
ADHESIVE = Material(MODULUS, 0.05, 2.071e-9)
BARE = Material(MODULUS, 0.0, 2.071e-9)


@pytest.fixture(scope="module")
def surface():
    return SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 16, 0.8).realise(64, 1)


def test_targets_of_every_kind_are_met_exactly_and_in_the_order_of_the_path(surface):
    height = surface.rms_height
    snapshots = [("relative_load", 7e-3), ("mean_separation", 1.7 * height), ("area_fraction", 0.013)]
    snapshots += [("force", 6e-4), ("indentation", -1.6 * height), ("contact_radius", 7e-6)]
    snapshots += [("pressure", 5e4)]
    for stops in (
        {"reduced_pressures": [1e-4, 2e-3, 1.1e-2, 3e-2]},
        {"area_fractions": [1e-3, 9e-3, 5e-2]},
        {"mean_separations": [2.2 * height, 1.1 * height]},
        {"contact_radii": [2e-6, 1.2e-5]},
    ):
        run = simulate(surface, ADHESIVE, Path(**stops, snapshots=snapshots))
        assert run.sizes["step"] == len(next(iter(stops.values()))) + 7
        reached = {
            "reduced_pressure": run.nominal_pressure / (MODULUS * surface.rms_slope),
            "relative_load": run.nominal_pressure / MODULUS,
            "area_fraction": run.contact_area_fraction,
            "mean_separation": run.mean_separation,
            "force": run.nominal_pressure * PERIOD**2,
            "pressure": run.nominal_pressure,
            "indentation": -run.mean_separation,
            "contact_radius": PERIOD * np.sqrt(run.contact_area_fraction / np.pi),
        }
        for step in run.step.values:
            kind, target = str(run.step_kind[step].item()), float(run.step_target[step])
            assert float(reached[kind][step]) == pytest.approx(target, rel=1e-9), (kind, target)
        assert np.all(np.diff(run.mean_separation) < 0) and np.all(np.diff(run.contact_area_fraction) > 0)
        assert np.all(run.residual <= RESIDUAL_TOLERANCE)
        assert sorted(run.snapshot_kind.values) == sorted(kind for kind, _ in snapshots)
        assert "in N where snapshot_kind is force" in run.snapshot_target.attrs["comment"]
        at = run.snapshot_step.values
        assert np.all(np.diff(at) > 0)
        np.testing.assert_array_equal(run.step_kind.values[at], run.snapshot_kind.values)
        np.testing.assert_array_equal(run.step_target.values[at], run.snapshot_target.values)


def test_a_target_that_is_also_a_snapshot_is_one_step(surface):
    run = simulate(surface, BARE, Path([1e-3, 1e-2], snapshots=[("reduced_pressure", 1e-2)]))
    assert run.sizes["step"] == 2 and run.snapshot_step.values.tolist() == [1]
    # None: the last target; an empty list: no snapshot.
    for snapshots, expected in ((None, [False, True]), ([], [False, False])):
        assert [t.snapshot for t in Path(area_fractions=[0.01, 0.02], snapshots=snapshots).targets] == expected


def test_a_state_does_not_depend_on_the_kind_of_its_target(surface):
    one = simulate(surface, ADHESIVE, Path([2e-2]))
    for path in (
        Path(area_fractions=[float(one.contact_area_fraction[0])]),
        Path(mean_separations=[float(one.mean_separation[0])]),
        Path([0.1], snapshots=[("relative_load", 2e-2 * surface.rms_slope)]),
    ):
        other = simulate(surface, ADHESIVE, path)
        for name in ("contact_area_fraction", "nominal_pressure", "mean_separation", "contact_stiffness"):
            assert float(other[name][0]) == pytest.approx(float(one[name][0]), rel=1e-7), name


def test_steps_of_half_the_length_and_more_targets_change_the_area_by_less_than_a_per_cent():
    # Enough summits that one event is not a per cent of the area.
    large = SelfAffineSpectrum(PERIOD, 0.2 * PERIOD, PERIOD / 32, 0.8).realise(128, 1)
    few = simulate(large, ADHESIVE, Path([1e-3, 1e-2], max_step=0.1))
    many = simulate(large, ADHESIVE, Path([3e-4, 1e-3, 2e-3, 5e-3, 1e-2], max_step=0.05))
    for name in ("contact_area_fraction", "mean_separation"):
        np.testing.assert_allclose(many[name][[1, -1]], few[name], rtol=0.01)


def test_a_target_inside_a_jump_is_met_on_the_branch_after_it_before_pull_off(surface):
    """The first contact with adhesion jumps to a finite area, and pulls off from a smaller one as the surfaces part."""
    contact = contact_of(surface, ADHESIVE)
    first = contact.equilibrium(contact.untouched(), contact.untouched().separation * (1 - 1e-9))
    jumped = contact.area_fraction(first)
    assert contact.pressure(first) < 0
    R, a = first.spots.radius_of_curvature[0], first.spots.contact_radius[0]
    pull_off = sphere_pull_off(R, ADHESIVE.contact_modulus, ADHESIVE.surface_energy)
    smallest = (float(pull_off.contact_radius) / a) ** 2
    assert 0.5 < smallest < 1
    part = 0.5 * (1 + smallest)
    run = simulate(surface, ADHESIVE, Path(area_fractions=[part * jumped]))
    assert float(run.contact_area_fraction[0]) == pytest.approx(part * jumped, rel=1e-9)
    assert int(run.spot_count[0]) == 1 and float(run.mean_separation[0]) > contact.untouched().separation
    for part in (0.98 * smallest, 0.1):
        with pytest.raises(ConvergenceError, match="lies inside a jump") as caught:
            simulate(surface, ADHESIVE, Path(area_fractions=[part * jumped]))
        assert caught.value.dataset.sizes["step"] == 0


def model_of(surface, model):
    return model(JKR(BARE), find_summits(surface), surface.rms_height, surface.rms_slope)


def test_no_step_is_longer_than_asked(surface):
    seen = []

    class Watched(InteractingAsperities):
        def equilibrium(self, state, *arguments):
            reached = super().equilibrium(state, *arguments)
            seen.append((state.separation - reached.separation) / self.rms_height)
            return reached

    contact = model_of(surface, Watched)
    for _ in follow(contact, Path(reduced_pressures=[1e-2], max_step=0.07)):
        pass
    assert 0.069 < max(seen) <= 0.07 * (1 + 1e-9)


def test_steps_that_fail_are_halved_and_then_given_up(surface):
    widths = []

    class Failing(InteractingAsperities):
        def equilibrium(self, state, separation, control=None):
            if separation < 1.5 * self.rms_height:
                if control is None:
                    widths.append(state.separation - separation)
                raise NotConverged("on purpose")
            return super().equilibrium(state, separation, control)

    path = Path(reduced_pressures=[1e-3, 1e-1])
    stops = follow(model_of(surface, Failing), path)
    assert next(stops).target.value == 1e-3
    with pytest.raises(NotConverged, match=r"after 1 of 2 stops: on purpose"):
        next(stops)
    # No step is halved below 2^-14 of the longest.
    assert 2.0**-14 <= min(widths) / max(widths) < 2.0**-13


UNDER_LOAD = {"control": "load", "unload": True}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"reduced_pressures": [0.1], "area_fractions": [0.1]}, "reduced_pressures, area_fractions"),
        ({"reduced_pressures": [1e-2, 1e-3]}, r"reduced_pressures\[1\].*increasing"),
        ({"mean_separations": [1e-6, 2e-6]}, r"mean_separations\[1\].*decreasing"),
        ({"forces": [0.0, 1e31]}, r"forces\[1\]: 1e\+31 must be .* \(in N\)"),
        ({"reduced_pressures": [101.0]}, r"reduced_pressures\[0\]: .* at most 100"),
        ({"reduced_pressures": [0.1], "unload": 1}, "unload: expected True or False, got 1"),
        ({"reduced_pressures": [0.1], "snapshots": [("load", 0.1)]}, r"snapshots\[0\].*kind"),
        ({"reduced_pressures": [0.1], "snapshots": [("area_fraction", 1.1)]}, r"snapshots\[0\]: .* in "),
        ({"reduced_pressures": [0.1], "snapshots": [("area_fraction", 0.1)] * 2}, r"snapshots\[1\].*twice"),
        # Unloading.
        ({"reduced_pressures": [0.1], "control": "force", "unload": True}, "^control: 'force' must be one of sep"),
        ({"reduced_pressures": [0.1], "control": "load"}, "^control: 'load'"),
        (
            {"reduced_pressures": [0.1], "turning_points": [("load", 0.01)]},
            r"^turning_points\[0\]: kind 'load' must be",
        ),
        ({"forces": [0.1], "turning_points": [("force", 0.1)]}, r"^turning_points\[0\]: 0.1 .*0\.1"),
        ({"forces": [0.1], "turning_points": [("force", 0.05), ("force", 0.04)]}, r"^turning_points\[1\]: 0.04"),
        ({"reduced_pressures": [0.1], **UNDER_LOAD, "turning_points": [("area_fraction", 0.05)]}, "^control: 'load'"),
        ({"reduced_pressures": [0.1], **UNDER_LOAD, "snapshots": [("area_fraction", 0.05)]}, "^control: 'load'"),
    ],
)
def test_bad_paths_are_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=message):
        Path(**arguments)


def test_the_approach_to_first_contact_costs_nothing(surface):
    """A target a metre up is met without small steps from there to first contact."""
    path = Path(mean_separations=[1.0, 1.5 * surface.rms_height], snapshots=[])
    stops = [(w.target, w.state) for w in follow(contact_of(surface, BARE), path)]
    assert [len(state.spots) > 0 for _, state in stops] == [False, True]
    reached = [state.separation for _, state in stops]
    assert reached == pytest.approx([1.0, 1.5 * surface.rms_height], rel=1e-12)


def test_a_snapshot_before_first_contact_is_all_gap(surface):
    high = 8 * surface.rms_height
    path = Path(reduced_pressures=[1e-3], snapshots=[("mean_separation", high)])
    run = simulate(surface, ADHESIVE, path)
    assert float(run.contact_area_fraction[0]) == 0 and run.sizes["spot"] == 0
    assert float((run.gap_density * np.diff(run.gap_bin_edges)).sum()) == pytest.approx(1, abs=1e-12)
    assert all(check.passed for check in check_run(run))
    with pytest.raises(ValueError, match=r"path: a snapshot at a mean separation of 1\.0 m"):
        simulate(surface, ADHESIVE, Path(reduced_pressures=[1e-3], snapshots=[("mean_separation", 1.0)]))


def egg_box(waves=4, grid=64):
    """Equal summits, all of which jump into contact at once."""
    x = 2 * np.pi * waves * np.arange(grid) / grid
    return Surface(heights=1e-6 * (np.cos(x)[None, :] + np.cos(x)[:, None]), period=PERIOD)


def test_targets_inside_a_jump_are_left_out_and_the_others_met():
    surface = egg_box()
    first_contact = contact_of(surface, ADHESIVE).untouched().separation
    jumped = simulate(surface, ADHESIVE, Path(mean_separations=[first_contact * (1 - 1e-9)]))
    first = float(jumped.contact_area_fraction[0])
    assert first > 5e-3
    with pytest.raises(ConvergenceError, match="after 2 of 4 stops") as caught:
        simulate(surface, ADHESIVE, Path(area_fractions=[0.2 * first, 0.4 * first, 0.05, 0.1]))
    message, run = str(caught.value), caught.value.dataset
    assert message.count("lies inside a jump") == 2 and f"jumps from 0 to {first:.3g}"[:24] in message
    assert "sticky" not in message
    np.testing.assert_allclose(run.contact_area_fraction, [0.05, 0.1], rtol=1e-9)
    kept = simulate(surface, ADHESIVE, Path(area_fractions=[0.05, 0.1]))
    np.testing.assert_allclose(run.mean_separation, kept.mean_separation, rtol=1e-6)


def test_no_state_outside_the_range_of_the_model_is_returned(surface):
    with pytest.raises(ConvergenceError, match=r"grows to 0\.\d\d of the nominal area, outside the range") as caught:
        simulate(surface, Material(MODULUS, 0.3, 2.071e-9), Path(mean_separations=[surface.rms_height, 1e-12]))
    assert caught.value.dataset.sizes["step"] == 1
