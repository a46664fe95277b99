"""The interface of contact models: a path needs no more of a model."""

import pytest

from icha import Material, Path, SelfAffineSpectrum
from icha.asperity.jkr import JKR
from icha.contact.model import ContactModel
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.surfaces.summits import find_summits

PERIOD, MODULUS = 100e-6, 25e6
SURFACE = SelfAffineSpectrum(PERIOD, 40e-6, PERIOD / 7, 0.8, 0.5).realise(grid=32, seed=1)


class Only:
    """Only those attributes of an object that a protocol names."""

    def __init__(self, whole, protocol):
        self._whole, self._names = whole, {name for name in vars(protocol) if not name.startswith("_")}

    def __getattr__(self, name):
        if name not in self._names:
            raise AttributeError(f"{name} is not in the interface")
        return getattr(self._whole, name)


def model(law):
    return InteractingAsperities(law, find_summits(SURFACE), SURFACE.rms_height, SURFACE.rms_slope)


def last(contact, loads, **path):
    return list(follow(contact, Path(reduced_pressures=loads, **path)))[-1].state


@pytest.mark.parametrize("path", [{}, {"unload": True, "control": "load"}], ids=str)
def test_a_path_asks_a_model_for_no_more_than_its_interface(path):
    contact = model(JKR(Material(MODULUS, 0.05, 2.071e-9)))
    expected, found = (last(each, [1e-4, 5e-4], **path) for each in (contact, Only(contact, ContactModel)))
    assert found.separation == expected.separation
