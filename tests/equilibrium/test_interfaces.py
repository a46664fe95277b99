"""The two interfaces: equilibria need no more of a law, and paths no more of a model, than these say."""

import numpy as np
import pytest

from icha import Material, Path, SelfAffineSpectrum
from icha.asperity.jkr import JKR
from icha.asperity.law import SpotLaw
from icha.contact.model import ContactModel
from icha.equilibrium.distributions import gap_distribution, pressure_distribution
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.surfaces.summits import find_summits

PERIOD, MODULUS = 100e-6, 25e6
SURFACE = SelfAffineSpectrum(PERIOD, 40e-6, PERIOD / 7, 0.8, 0.5).realise(grid=32, seed=1)


class Only:
    """What a protocol names of an object, and nothing else."""

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


@pytest.mark.parametrize("energy", [0.0, 0.05])
def test_an_equilibrium_asks_a_law_for_no_more_than_its_interface(energy):
    law = JKR(Material(MODULUS, energy, 2.071e-9))
    expected, found = (last(model(each), [1e-3, 6e-2]) for each in (law, Only(law, SpotLaw)))
    assert len(found.spots) > 3 and np.any(found.spots.members > 1)
    np.testing.assert_array_equal(found.spots.contact_radius, expected.spots.contact_radius)
    gap_distribution(Only(law, SpotLaw), SURFACE, found)
    pressure_distribution(Only(law, SpotLaw), SURFACE, found.spots)


@pytest.mark.parametrize("path", [{}, {"unload": True, "control": "load"}], ids=str)
def test_a_path_asks_a_model_for_no_more_than_its_interface(path):
    contact = model(JKR(Material(MODULUS, 0.05, 2.071e-9)))
    expected, found = (last(each, [1e-4, 5e-4], **path) for each in (contact, Only(contact, ContactModel)))
    assert found.separation == expected.separation
