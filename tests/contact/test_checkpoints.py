"""Interrupted paths resume from their checkpoints."""

import pytest
from xarray.testing import assert_identical

from icha import Material, Path, SelfAffineSpectrum, simulate
from icha.boundary_elements import contact
from icha.boundary_elements.contact import BoundaryElements
from icha.contact.checkpoints import prepare_checkpoints
from icha.simulation import ConvergenceError

SURFACE = SelfAffineSpectrum(1e-6, 1e-6, 0.5e-6, 0.8).realise(16, 1).scaled_to_rms_slope(0.3)
PATHS = {
    "unloading": (Material(1e6, 1e-4, 1e-9), Path(reduced_pressures=[2e-3], unload=True, max_step=0.5)),
    "areas": (Material(1e6, 0.01, 1e-8), Path(area_fractions=[0.05, 0.1])),
    "a failure": (Material(1e6, 0.01, 1e-8), Path(area_fractions=[1e-4, 0.05], max_step=0.5)),
}


def followed(monkeypatch, case, folder, most):
    """Return the dataset of a simulation, also of a failed one, and the number of its solves; stop it after `most`."""
    found, count = BoundaryElements.equilibrium, 0

    def equilibrium(*args, **options):
        nonlocal count
        if count == most:
            raise KeyboardInterrupt
        count += 1
        return found(*args, **options)

    with monkeypatch.context() as patch:
        patch.setattr(BoundaryElements, "equilibrium", equilibrium)
        material, path = PATHS[case]
        try:
            dataset = simulate(SURFACE, material, path, model="boundary_elements", kept=folder)
        except ConvergenceError as failure:
            dataset = failure.dataset
        except KeyboardInterrupt:
            dataset = None
    return dataset, count


@pytest.mark.parametrize("case", ["unloading", "areas", pytest.param("a failure", marks=pytest.mark.slow)])
def test_a_path_that_was_stopped_goes_on_to_the_same_last_bit(monkeypatch, case, tmp_path):
    whole, needed = followed(monkeypatch, case, None, None)
    # The target of this path lies inside a jump.
    assert ("beyond_model" in whole.attrs) == (case == "a failure") and needed > 3
    folder = prepare_checkpoints(tmp_path / "kept", "this path")
    half = needed // 2
    assert followed(monkeypatch, case, folder, half) == (None, half)
    again, further = followed(monkeypatch, case, folder, None)
    assert_identical(again, whole)
    # Only the interrupted solve is repeated.
    assert further == needed - half
    assert followed(monkeypatch, case, prepare_checkpoints(folder, "this path"), None)[1] == 0


def test_what_was_kept_of_another_path_is_never_taken_for_this_ones(tmp_path, monkeypatch):
    folder = prepare_checkpoints(tmp_path / "kept", "another path")
    (folder / "00000.npz").write_bytes(b"an equilibrium of the other path")

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as patch:
        patch.setattr("os.unlink", refuse)
        with pytest.raises(PermissionError):
            prepare_checkpoints(folder, "this path")
    prepare_checkpoints(folder, "this path")
    assert [file.name for file in folder.iterdir()] == ["of.txt"]


def test_what_is_damaged_is_looked_for_again(monkeypatch, tmp_path):
    folder = prepare_checkpoints(tmp_path / "kept", "this path")
    whole, _ = followed(monkeypatch, "areas", folder, None)
    first, second, *_ = sorted(folder.glob("*.npz"))
    first.write_bytes(first.read_bytes()[:100])
    second.write_bytes(b"")
    again, needed = followed(monkeypatch, "areas", folder, None)
    assert needed == 2
    assert_identical(again, whole)


def test_of_another_contact_or_path_nothing_is_found_but_what_both_share(monkeypatch, tmp_path):
    """A folder may be given by hand: what it has of other calls must not be taken for what is asked for."""
    folder = tmp_path / "kept"
    material, path = PATHS["areas"]
    followed(monkeypatch, "areas", folder, None)
    monkeypatch.setitem(PATHS, "stiffer", (Material(2e6, 0.02, 1e-8), path))  # jumps in at the same separation
    monkeypatch.setitem(PATHS, "other way", (material, Path(area_fractions=[0.07, 0.1])))
    # The first step of the other way is the same.
    for case, same in (("stiffer", 0), ("other way", 1)):
        expected, needed = followed(monkeypatch, case, None, None)
        found, computed = followed(monkeypatch, case, folder, None)
        assert_identical(found, expected)
        assert computed == needed - same


def test_of_other_programs_and_by_asperities_nothing_is_found(monkeypatch, tmp_path):
    folder = tmp_path / "kept"
    _, needed = followed(monkeypatch, "areas", folder, None)
    monkeypatch.setattr(contact, "version", lambda name: "0.0")
    _, computed = followed(monkeypatch, "areas", folder, None)
    assert computed == needed
    with pytest.raises(ValueError, match=r"^kept: the model asperities has no checkpoints"):
        simulate(SURFACE, *PATHS["areas"], kept=tmp_path)
