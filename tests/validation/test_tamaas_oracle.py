"""Contacts by Tamaas, an independent code: without adhesion those of ICHA, with adhesion in equilibrium."""

import numpy as np
import pytest
import scipy.fft

import icha
from icha.boundary_elements.contact import contact_of
from icha.contact.model import PRESSURE, Control

pytest.importorskip("tamaas", reason="`make tamaas` installs Tamaas")
from validation.tamaas_oracle import contact_at_load, contacts_at_gaps

SPECTRUM = icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=12.5e-6, hurst=0.8)
SURFACE = SPECTRUM.realise(64, 1)


@pytest.mark.parametrize("reduced_pressure", [3e-3, 0.3])
def test_without_adhesion_it_agrees_with_icha(reduced_pressure):
    material = icha.Material(25e6, 0.0)
    load = reduced_pressure * material.contact_modulus * SURFACE.rms_slope
    theirs, contact = contact_at_load(SURFACE, material, load, 1e-10), contact_of(SURFACE, material)
    ours = contact.equilibrium(contact.untouched(), float(theirs.gap.mean()), Control(PRESSURE, load))
    np.testing.assert_allclose(contact.gap(ours), theirs.gap, atol=1e-6 * SURFACE.rms_height)
    assert contact.area_fraction(ours) == pytest.approx(theirs.area_fraction, rel=1e-3)


def test_with_adhesion_the_traction_outside_contact_is_the_attraction():
    material = icha.Material(25e6, 0.05, 300e-9)
    mean_gaps = SURFACE.rms_height * np.array([2.0, 1.6])
    n, strength = SURFACE.grid, material.surface_energy / material.interaction_range
    q = 2 * np.pi / SURFACE.period * np.hypot(scipy.fft.fftfreq(n, 1 / n)[:, None], scipy.fft.rfftfreq(n, 1 / n))
    for state, mean_gap in zip(contacts_at_gaps(SURFACE, material, mean_gaps), mean_gaps, strict=True):
        assert state.gap.mean() == pytest.approx(mean_gap, rel=1e-9)
        outside = state.gap > 0
        attraction = strength * np.exp(-state.gap / material.interaction_range)
        np.testing.assert_allclose(state.traction[outside], -attraction[outside], atol=1e-2 * strength)
        # The elastic body: traction E* q/2 times displacement, without the mean.
        displacement = scipy.fft.rfft2(state.gap + SURFACE.heights)
        elastic = scipy.fft.irfft2(material.contact_modulus * q / 2 * displacement, s=(n, n))
        np.testing.assert_allclose(state.traction - state.traction.mean(), elastic, atol=1e-6 * np.abs(elastic).max())
