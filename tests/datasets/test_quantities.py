"""One table of quantities: every unit is that of the variable in files, and the symbols are the same in all forms."""

import pytest

from icha.datasets.quantities import _QUANTITIES, quantity, state_words
from icha.datasets.variables import campaign, model_error, run, sensitivity


def test_units_are_those_of_the_variables_in_files():
    files = {}
    for module in (run, campaign, model_error, sensitivity):
        for table in (each for each in vars(module).values() if isinstance(each, dict)):
            files |= {name: each.units for name, each in table.items() if hasattr(each, "units")}
    shared = _QUANTITIES.keys() & files.keys()
    assert {"contact_stiffness", "hysteresis_loss", "pull_off_force", "surface_energy", "jaccard"} <= shared
    assert {name: _QUANTITIES[name].unit for name in shared} == {name: files[name] for name in shared}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("reduced_pressure", "p*"),
        ("relative_load", "p/E*"),
        ("contact_area_fraction", "A/A0"),
        ("reduced_separation", "ū/h_rms"),
        ("rms_slope", "h'rms"),
        ("surface_energy", "Δγ"),
        ("contact_radius", "√(A/π)"),
        ("rolloff_wavelength", "λ_r"),
        ("a_key_without_words", "a key without words"),
    ],
)
def test_symbols_as_plain_text(name, text):
    assert quantity(name).text == text


def test_words_for_a_state():
    assert state_words("reduced_pressure", 0.01) == "p* = 0.01"
    assert state_words("area_fraction", 0.05) == "A/A0 = 0.05"
    assert state_words("pressure", 1e4) == "pressure 10 kPa"
    assert state_words("indentation", 1e-6) == "indentation 1 µm"
