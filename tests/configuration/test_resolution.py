"""Grids that do not resolve waves or contacts, and ranges of attraction: refused unless confirmed, and stated then."""

import numpy as np
import pytest
from demo_configuration import file_surface, measured_surface

from icha.planning.validity import expected_validity
from icha.surfaces.spectrum import SelfAffineSpectrum

BARE = {"materials.soft.surface_energy": "0 J/m^2"}


def smooth(shape, side="200 um", grid=32, **targets):
    section = {"kind": "smooth", "side": side, "grid": grid, "shape": shape}
    changes = {"surfaces.rough": section, "studies.one.models": ["boundary_elements"], "studies.one.seeds": None}
    return changes | {
        "studies.one.rms_slopes": None,
        "studies.one.snapshots": None,
        "studies.one.targets": targets,
    }


def stated(configuration):
    return {each.about: each for each in expected_validity(configuration.campaign)}


def confirmed(load, refused, changes, message, key):
    """Check that a configuration is refused unless it confirms a key; return the statements about the campaign."""
    refused("", changes, message)
    refused("", changes, f"`confirmed: [{key}]`")
    configuration = load(changes | {"confirmed": [key]})
    assert any(message.split(" (")[0] in each for each in configuration.warnings)
    return stated(configuration)


@pytest.mark.parametrize("models", [["asperities"], ["boundary_elements"]])
def test_random_surfaces(models, load, refused):
    changes = BARE | {"studies.one.models": models, "surfaces.rough.grid": 30}
    message = "surfaces.rough.grid: 30 is unusual (3 cells per shortest wave); expected a grid of at least 40 nodes"
    found = confirmed(load, refused, changes, message, "surfaces.rough.grid")
    assert "few grid cells: rough has 3 cells per shortest wave" in found["grid"].text and not found["grid"].good
    # From 4 to 8 cells, the areas of boundary elements have an error.
    found = stated(load(changes | {"surfaces.rough.grid": 48}))
    assert ("grid" in found) == (models == ["boundary_elements"])
    assert "grid" not in stated(load(changes | {"surfaces.rough.grid": 80}))


@pytest.mark.parametrize("measured", [False, True])
def test_heights_of_files_whose_shortest_wave_is_estimated(measured, load, refused, tmp_path):
    for cells, coarse in ((2.6, True), (6, False)):
        heights = SelfAffineSpectrum(1e-3, 5e-4, 1e-3 * cells / 64, 0.8, 0.1).realise(64, 1).heights
        np.save(tmp_path / "heights.npy", heights * 1e6)
        section = file_surface("heights.npy")
        if measured:
            section = measured_surface(path="heights.npy", size="1 mm", height_unit="um", boundary="periodic")
        changes = BARE | {"surfaces.rough": section}
        if coarse:
            key = "surfaces.rough.grid" if measured else "surfaces.rough.path"
            refused("", changes, "cells per shortest wave, estimated from the spectrum)")
            refused("", changes, "or `cutoff: 130 um`" if measured else "expected a file with a grid of at least")
            found = stated(load(changes | {"confirmed": [key]}))
            assert "estimated from the spectrum" in found["grid"].text
        else:
            load(changes)
    if measured:
        spike = np.where(np.arange(64) == 9, 5e-5, 0) * (np.arange(64) == 7)[:, None]
        np.save(tmp_path / "heights.npy", (heights + spike) * 1e6)
        refused("", changes, "expected `outliers: remove` first, because the scan has 1 outlier, the largest ")


def test_waves_of_shapes(load, refused):
    wave = {"radius": "1 mm", "amplitude": "50 nm", "wavelength": "5 um"}
    coarse = smooth({"wave": wave}, indentations=["0.3 um"])
    refused("", coarse, "shape: has 0.8 cells per shortest wave, but at least 2 are needed; expected a longer wave")
    found = confirmed(
        load,
        refused,
        BARE | coarse | {"surfaces.rough": coarse["surfaces.rough"] | {"grid": 120}},
        "surfaces.rough.grid: 120 is unusual (3 cells per shortest wave); expected a grid of at least 160 nodes",
        "surfaces.rough.grid",
    )
    assert "3 cells per shortest wave" in found["grid"].text
    assert "grid" not in stated(load(BARE | coarse | {"surfaces.rough": coarse["surfaces.rough"] | {"grid": 320}}))
    # The waves of the shape of a rough indenter count too.
    rough = {"surfaces.rough.shape": {"wave": wave}, "surfaces.rough.short_wavelength": "6 um"}
    rough |= {"studies.one.models": ["boundary_elements"]}
    refused("", rough | {"surfaces.rough.grid": 70}, "surfaces.rough.grid: 70 is unusual (3.5 cells per shortest wave)")


@pytest.mark.parametrize(
    ("shape", "targets", "cells"),
    [
        ({"sphere": {"radius": "1 mm"}}, {"indentations": ["0.4 um", "2 um"]}, "3.2"),
        ({"cone": {"half_angle": "80 deg"}}, {"forces": ["1 mN", "5 mN"]}, "1.92"),
        ({"cylinder_punch": {"radius": "20 um"}}, {"forces": ["1 mN"]}, "3.2"),
        ({"sphere": {"radius": "1 mm"}}, {"contact_radii": ["10 um", "40 um"]}, "1.6"),
    ],
)
def test_contact_radii_of_smooth_shapes(shape, targets, cells, load, refused):
    (kind,) = targets
    message = f" is unusual ({cells} cells per contact radius for soft on rough); expected larger targets, or a grid"
    key = f"studies.one.targets.{kind}"
    found = confirmed(load, refused, BARE | smooth(shape, **targets), message, key)
    assert f"rough has {cells} cells per contact radius" in found["grid"].text and not found["grid"].good
    assert "grid" not in stated(load(BARE | smooth(shape, grid=512, **targets)))


def test_long_ranges_of_boundary_elements(load, refused):
    bead = smooth({"sphere": {"radius": "10 um"}}, side="12 um", grid=96, forces=["2 mN"])
    glass = {"contact_modulus": "70 GPa", "surface_energy": "50 mJ/m^2"}
    message = "materials.soft.interaction_range: '500 pm' is unusual for boundary elements of soft on rough"
    found = confirmed(load, refused, bead | {"materials.soft": glass}, message, "materials.soft.interaction_range")
    assert "Tabor parameter 0.34" in found["short range"].text and "17 %" in found["short range"].text
    assert "JKR does not hold" in found["indenter"].text and not found["indenter"].good
    # A finer grid resolves the range.
    fine = bead | {"surfaces.rough.grid": 128, "materials.soft": glass}
    resolved = stated(load(fine))
    assert "short range" not in resolved and resolved["finite range"].good
    assert "soft on rough" in resolved["finite range"].text
    # From 1 to 3 there is only the statement.
    assert not stated(load(bead | {"materials.soft": glass | {"interaction_range": "0.1 nm"}}))["short range"].good
    assert "short range" not in stated(load(bead | {"materials.soft": glass | {"interaction_range": "0.05 nm"}}))
    # Rough surfaces have the radius of the rms curvature. Asperities assume no short range.
    rough = {"materials.soft.interaction_range": "60 nm", "studies.one.models": ["boundary_elements"]}
    refused("", rough, "materials.soft.interaction_range: '60 nm' is unusual for boundary elements of soft on rough")
    load(rough | {"studies.one.models": ["asperities"]})
