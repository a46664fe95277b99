"""Tabulated spectra: realisations, merging of scans at several magnifications, profiles, wrong tables."""

import numpy as np
import pytest
from scipy.integrate import quad

import icha
from icha.surfaces.moments import spectral_moments
from icha.surfaces.tabulated_spectrum import CONVENTIONS, SpectrumTable, merge_spectra, read_spectrum_table

SIDE = 100e-6
TRUE = icha.SelfAffineSpectrum(SIDE, 25e-6, 5e-6, 0.8, rms_slope=0.1)
Q = np.geomspace(2 * np.pi / SIDE, 2 * np.pi / 5e-6 * 0.9999, 400)
TABLE = SpectrumTable(Q, TRUE.psd(Q))


def test_a_table_of_a_self_affine_spectrum_gives_the_same_surface():
    spectrum = TABLE.in_cell(SIDE)
    assert spectrum.rms_slope == pytest.approx(0.1, rel=2e-3)
    assert spectrum.rms_height == pytest.approx(TRUE.rms_height, rel=2e-3)
    one, other = spectrum.realise(160, 3), TRUE.realise(160, 3)
    np.testing.assert_allclose(one.heights, other.heights, atol=0.02 * other.rms_height)
    moments, expected = (spectral_moments(each) for each in (one, other))
    np.testing.assert_allclose([moments.m0, moments.m2, moments.m4], [expected.m0, expected.m2, expected.m4], rtol=0.01)


def test_a_table_is_written_and_read_in_any_unit_of_length(tmp_path):
    TABLE.save(tmp_path / "table.csv")
    np.testing.assert_allclose(read_spectrum_table(tmp_path / "table.csv").power, TABLE.power, rtol=1e-8)
    rows = [f"{q * 1e-6:.9e},{power * 1e24:.9e}" for q, power in zip(TABLE.wave_number, TABLE.power, strict=True)]
    (tmp_path / "um.csv").write_text("# q, C\n" + "\n".join(rows), encoding="utf-8")
    found = read_spectrum_table(tmp_path / "um.csv", 1e-6)
    np.testing.assert_allclose(found.wave_number, Q, rtol=1e-8)
    np.testing.assert_allclose(found.power, TABLE.power, rtol=1e-7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2\nx y\n", "column 1, line 2: 'x'; expected a number greater than 0"),
        ("1 2 3\n2 3 4\n", "has 3 fields in line 1; expected 2"),
        ("1 2\n", "has 1 rows; expected at least two"),
        ("1 2\n1 3\n", "do not increase"),
        ("0 2\n2 3\n", "column 1, line 1: '0'"),
        ("1,5,2\n2,5,1\n", "decimal commas need semicolons"),
        ("1,234;2\n2,345;1\n", "may be decimal or separate thousands"),
        ("q (1/px), C (px^4)\n1, 2\n2, 1\n", "expected units of length in brackets"),
        ("lambda (um), C (um^4)\n1, 2\n2, 1\n", "the first column looks like a wavelength; expected wave numbers"),
        ("log10 q, log10 C\n1, 2\n2, 1\n", "the numbers look like logarithms; expected the values themselves"),
        ("q (rad/m) x 1e6, C (m^4)\n1, 2\n2, 1\n", "contains a factor"),
        ("# units: nm\n1, 2\n2, 1\n", "is missing, but the heading states 'units: nm'"),
    ],
)
def test_wrong_tables_are_refused(text, message, tmp_path):
    (tmp_path / "table.txt").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_spectrum_table(tmp_path / "table.txt")
    with pytest.raises(ValueError, match="no wave of the table fits"):
        TABLE.in_cell(4e-6)


ROWS = [f"{q:.9e};{power:.9e}" for q, power in zip(Q * 1e-6, TABLE.power * 1e24, strict=True)]


@pytest.mark.parametrize(
    ("heading", "encoding"),
    [
        ("q (rad/um);C (um^4)", "utf-8-sig"),
        ("Wellenzahl q in µm\nq (rad/µm);C (µm⁴)", "utf-16"),
        ("# Höhen in µm\nq [rad/µm];C [µm^4]", "cp1252"),
        ("q;C\nrad/um;um^2 um^2", "utf-8"),
        ("wave number [µm⁻¹ rad];power", "utf-8"),
        ("# q in rad/um, C in um^4\nq;C", "utf-8"),
    ],
)
@pytest.mark.parametrize("decimal", ".,")
def test_headings_encodings_and_decimal_commas(tmp_path, heading, encoding, decimal):
    """The units in the titles are those of the columns."""
    path = tmp_path / "table.csv"
    path.write_text("\n".join([heading, *ROWS]).replace(".", decimal) + "\n", encoding=encoding)
    found = read_spectrum_table(path)
    np.testing.assert_allclose(found.wave_number, Q, rtol=1e-8)
    np.testing.assert_allclose(found.power, TABLE.power, rtol=1e-7)
    with pytest.raises(ValueError, match="titles, which state") as raised:
        read_spectrum_table(path, 1e-9)
    assert raised.value.key == "length_unit"


def test_a_unit_in_a_line_of_its_own_agrees_with_the_configuration(tmp_path):
    (tmp_path / "table.txt").write_text("# units: nm\n1 2\n2 1\n")
    np.testing.assert_allclose(read_spectrum_table(tmp_path / "table.txt", 1e-9).wave_number, [1e9, 2e9])
    with pytest.raises(ValueError, match="is 1e-06 m, but the heading states 'units: nm'"):
        read_spectrum_table(tmp_path / "table.txt", 1e-6)
    (tmp_path / "table.txt").write_text("# Height unit: nm\n# q = 2*pi*f (rad/m), C (m^4)\n1 2\n2 1\n")
    np.testing.assert_allclose(read_spectrum_table(tmp_path / "table.txt").wave_number, [1, 2])


@pytest.mark.parametrize(
    ("titles", "convention"),
    [
        ("q (1/m);C (m^4)", None),
        ("q (rad/m);C (m^3)", None),
        ("q (rad/m);C (m^4)", "profile"),
        ("q (rad/m);C (m^4)", "surface_frequency"),
        ("f (cycles/m);C (m^4)", "surface"),
    ],
)
def test_titles_against_the_convention_are_refused(tmp_path, titles, convention):
    (tmp_path / "table.csv").write_text(f"{titles}\n1;2\n2;1\n")
    with pytest.raises(ValueError, match="the titles state") as raised:
        read_spectrum_table(tmp_path / "table.csv", convention=convention)
    assert raised.value.key == "convention"


def convert(convention):
    """Return the columns of a power law C = q^-3.6 in each convention, from its definition.

    Jacobs, Junge & Pastewka (2017): C2D = |FT|^2/A has h^2 = 1/(2 pi) int q C dq, C1D has h^2 = 1/pi int C dq. The
    frequency is f = q/(2 pi); the spectrum of profiles by frequency is one-sided, h^2 = int C df.
    """
    q = np.geomspace(1e4, 1e7, 31)
    surface = q**-3.6
    profile = np.array([2 * x**-2.6 * quad(lambda y: (1 + y**2) ** -1.8, 0, np.inf)[0] for x in q])
    return q, {
        "surface": (q, surface),
        "surface_jacobs": (q, (2 * np.pi) ** 2 * surface),
        "surface_frequency": (q / (2 * np.pi), (2 * np.pi) ** 2 * surface),
        "profile": (q, profile),
        "profile_jacobs": (q, 2 * np.pi * profile),
        "profile_frequency": (q / (2 * np.pi), 2 * 2 * np.pi * profile),
    }[convention]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_conventions_of_spectra(tmp_path, convention):
    q, columns = convert(convention)
    np.savetxt(tmp_path / "table.txt", np.column_stack(columns))
    found = read_spectrum_table(tmp_path / "table.txt", convention=convention)
    inside = (found.wave_number > 1.5 * q[0]) & (found.wave_number < q[-1] / 1.5)
    rtol = 1e-9 if convention.startswith("surface") else 1e-3
    np.testing.assert_allclose(found.power[inside], found.wave_number[inside] ** -3.6, rtol=rtol)


@pytest.mark.parametrize(
    ("rows", "step", "noise"), [(200, np.geomspace, 0), (30, np.geomspace, 0), (999, np.linspace, 1)]
)
def test_a_table_of_profiles_keeps_its_ends(tmp_path, rows, step, noise):
    """The reference is a power law without waves outside [1e5, 2.5e6] rad/m, from its definition."""
    low, high = 1e5, 2.5e6
    q = step(low, 0.999 * high, rows)
    end = np.sqrt(high**2 - q**2)
    one = np.array([2 * quad(lambda s, x=x: (x**2 + s**2) ** -1.8, 0, y)[0] for x, y in zip(q, end, strict=True)])
    one *= np.random.default_rng(1).gamma(4, 1 / 4, rows) if noise else 1
    np.savetxt(tmp_path / "table.txt", np.column_stack([q, one]), fmt="%.5e")
    found = read_spectrum_table(tmp_path / "table.txt", convention="profile")
    np.testing.assert_allclose(found.wave_number[[0, -1]], q[[0, -1]], rtol=1e-5)
    assert found.profile_height == pytest.approx(np.sqrt(2 * np.trapezoid(one, q)), rel=1e-5)
    height, slope = (np.sqrt(2 * np.pi * quad(lambda q, n=n: q ** (n - 3.6), low, high)[0]) for n in (1, 3))
    fine = np.geomspace(low, 0.999 * high, 10_000)
    power = np.exp(np.interp(np.log(fine), np.log(found.wave_number), np.log(found.power)))
    assert found.rms_height == pytest.approx(height, rel=0.05 if noise else 0.002)
    assert np.sqrt(2 * np.pi * np.trapezoid(fine**3 * power, fine)) == pytest.approx(
        slope, rel=0.04 if noise else 0.015
    )


def test_profiles_that_end_in_noise_are_refused(tmp_path):
    one = [*np.geomspace(1, 1e-3, 30), *1e-3 * np.random.default_rng(1).gamma(9, 1 / 9, 60)]
    np.savetxt(tmp_path / "table.txt", np.column_stack([np.geomspace(1, 1e3, 90), one]))
    with pytest.raises(ValueError, match=r"does not fall from q = .* rad/m to its end"):
        read_spectrum_table(tmp_path / "table.txt", convention="profile")


def part(whole, corner, nodes, step=1, noise=0.0):
    """Cut a free square out of a periodic surface; `step` leaves out nodes, as a lower magnification does."""
    heights = whole.heights[corner : corner + nodes * step : step, corner : corner + nodes * step : step]
    heights = heights + noise * np.random.default_rng(corner).normal(size=heights.shape)
    return icha.Surface(heights, whole.spacing * step * nodes, "free")


def test_scans_at_two_magnifications_merge_to_the_spectrum_of_the_sample():
    whole = icha.SelfAffineSpectrum(400e-6, 100e-6, 5e-6, 0.8, rms_slope=0.1)
    sample = whole.realise(1024, 1)
    noise = 2e-9
    scans = [part(sample, 0, 256, 4, noise), *(part(sample, corner, 200, 1, noise) for corner in (0, 300, 600))]
    merged = merge_spectra(scans)
    assert 2 * np.pi / merged.wave_number[0] > 150e-6 and 2 * np.pi / merged.wave_number[-1] < 6e-6
    ratio = merged.power / whole.psd(merged.wave_number)
    known = np.isfinite(ratio) & (merged.wave_number < 2 * np.pi / 6e-6)
    assert abs(np.mean(np.log(ratio[known]))) < 0.15 and np.std(np.log(ratio[known])) < 0.5
    assert merged.sources[0].startswith("scan 1: wavelengths from 6.25e-06 m") and "4 pixels" in merged.sources[0]
    assert "noise floor" in merged.sources[1]


def test_a_blunt_tip_shortens_the_trusted_range():
    scan = part(TRUE.realise(512, 1), 0, 200)
    sharp, blunt = (merge_spectra([scan], tip_radius=radius) for radius in (1e-9, 5e-6))
    assert blunt.wave_number[-1] < 0.8 * sharp.wave_number[-1] and "tip radius" in blunt.sources[0]


def test_profiles_of_an_isotropic_surface_give_its_spectrum():
    whole = icha.SelfAffineSpectrum(400e-6, 400e-6, 4e-6, 0.8, rms_slope=0.1)
    sample = whole.realise(512, 1)
    x = np.arange(512) * sample.spacing
    merged = merge_spectra(profiles=[(x, row) for row in sample.heights[::8]])
    shown = (merged.wave_number > 2 * np.pi / 100e-6) & (merged.wave_number < 2 * np.pi / 10e-6)
    ratio = merged.power[shown] / whole.psd(merged.wave_number[shown])
    assert abs(np.mean(np.log(ratio))) < 0.15 and np.std(np.log(ratio)) < 0.3
    assert "converted for an isotropic surface" in merged.sources[0] and merged.sources[0].startswith("profiles: ")


X = 2e-9 * np.arange(256)
Z = 1e-9 * np.random.default_rng(1).normal(size=256).cumsum()
GAP = np.where(np.arange(256) == 7, np.nan, Z)
UNEQUAL = X + 0.9e-9 * (np.arange(256) % 2)


@pytest.mark.parametrize(
    ("profiles", "message"),
    [
        ([(X, GAP)], "a profile has missing heights"),
        ([(X, Z), (X, np.where(GAP == GAP, Z, np.inf))], "a profile has missing heights"),
        ([(UNEQUAL, Z)], "equal, positive steps"),  # a step of 2 nm is not equal to one of 0.2 nm
        ([(X[:15], Z[:15])], "equal, positive steps"),
        ([(X, Z[:-1])], "equal, positive steps"),
        ((X, Z), "a list of pairs"),
        ([np.column_stack([X, Z])], "a list of pairs"),
        ([(X, 1e-9 + 3 * X)], "all the same, apart from its tilt"),
    ],
)
def test_profiles_without_a_spectrum_are_refused(profiles, message):
    assert len(merge_spectra(profiles=[(X, Z)]).power) > 2
    with pytest.raises(ValueError, match=message):
        merge_spectra(profiles=profiles)
