"""A few asperities of radius 1, pressed and pulled off, in units in which modulus and surface energy are 1 as well.

The cell is so large that its images do not matter, unless a test has another period.
"""

from functools import cache

import numpy as np
from half_space import displacement_by_quadrature, jkr_approach, jkr_force
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

import icha
from icha import Material, Path
from icha.asperity.jkr import JKR
from icha.contact.model import Events
from icha.equilibrium.interacting_asperities import InteractingAsperities
from icha.path.follow import follow
from icha.surfaces.summits import Asperities

FAR = 1e8
TABOR = 2.5
STICKY, BARE = Material(1.0, 1.0, 1 / TABOR), Material(1.0, 0.0, 1 / TABOR)
HEIGHT, RMS_HEIGHT = 100.0, 10.0
# The law of one asperity in these units; its jump-off radius, pull-off force and their approaches.
JUMP_OFF_RADIUS, PULL_OFF_RADIUS, NO_LOAD_RADIUS = (np.cbrt(part * np.pi) for part in (1 / 8, 9 / 8, 9 / 2))


def force(a, R=1.0):
    return jkr_force(a, R, 1.0, 1.0)


def approach(a, R=1.0):
    return jkr_approach(a, R, 1.0, 1.0)


JUMP_OFF_APPROACH, PULL_OFF_APPROACH = approach(JUMP_OFF_RADIUS), approach(PULL_OFF_RADIUS)
WU = (1 - 2.641 * TABOR ** (3 / 7)) / TABOR


def energy(a, R=1.0):
    """Work that makes a spot: the integral of F d(delta) along its curve, from a = 0."""
    return quad(lambda s: force(s, R) * (2 * s / R - np.sqrt(np.pi / (2 * s))), 0, a, epsabs=0, epsrel=1e-12)[0]


def stable_radius(d):
    return brentq(lambda a: approach(a) - d, JUMP_OFF_RADIUS, 50)


def contact_of(heights, positions=((0.5, 0.5),), radii=None, *, period=FAR, material=STICKY):
    """Asperities of given heights and places, measured from the middle of the cell if it is not one alone."""
    heights = np.array(heights, float)
    positions = np.array(positions, float) + period / 2
    radii = np.ones(len(heights)) if radii is None else np.array(radii, float)
    return InteractingAsperities(
        JKR(material), Asperities(positions, heights, radii, period), RMS_HEIGHT, 1e3 / period**2
    )


def travelled(contact, stops, **settings):
    """All waypoints of a path; reduced pressures are loads over 1000."""
    return list(follow(contact, Path(stops, **settings)))


def load(contact, waypoint):
    return contact.pressure(waypoint.state) * contact.area


def history(waypoints):
    return Events.concatenate(waypoints[-1].state.history)


def counts(state):
    """Numbers of jumps in, jumps off, unions and splits on the path to a state."""
    return Events.concatenate(state.history).counts().tolist()


def closed_again(waypoints):
    """The last waypoint: nothing touches any more."""
    assert not len(waypoints[-1].state.spots)
    return waypoints[-1].state


@cache
def alone(control="separation"):
    contact = contact_of([HEIGHT])
    return contact, travelled(contact, [0.01], unload=True, control=control)


def limit_point(displacement):
    """Largest radius-dependent separation above the summit of equal asperities, and the radius there."""
    found = minimize_scalar(lambda a: approach(a) + displacement(a), bounds=(0.4, 2), method="bounded")
    return -found.fun, found.x


def beside(distance, a):
    return displacement_by_quadrature(distance, a, 1.0, 1.0, 1.0)


@cache
def equal_pair():
    contact = contact_of([HEIGHT, HEIGHT], [[-4, 0], [4, 0]])
    return contact, travelled(contact, [0.005], unload=True)


def pair(lower, distance, material=STICKY):
    return contact_of([HEIGHT, HEIGHT - lower], [[-distance / 2, 0], [distance / 2, 0]], material=material)


def small():
    spectrum = icha.SelfAffineSpectrum(100e-6, 50e-6, 20e-6, 0.8, rms_slope=0.2)
    return spectrum.realise(32, 1), Material(0.24e6, 2e-3, 2e-9)


@cache
def united_run():
    """A small sticky surface on which two spots unite, pressed and pulled off."""
    return icha.simulate(*small(), Path([3.5e-2], unload=True))
