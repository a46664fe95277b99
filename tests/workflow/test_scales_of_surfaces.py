"""Heights and slopes that a study promises: each realisation has them once it is scaled for its run."""

import numpy as np
import pytest
from conftest import REPOSITORY

from icha.analysis.common_loads import compare_runs
from icha.asperity.material import Material
from icha.configuration.cases import run_settings, surface_settings
from icha.datasets.campaign_file import campaign_tree
from icha.datasets.labels import RunLabels
from icha.datasets.surface_file import read_scaled_surface
from icha.path.targets import Path
from icha.simulation import simulate
from icha.surfaces.spectrum import SelfAffineSpectrum
from icha.surfaces.tabulated_spectrum import SpectrumTable
from icha.tasks.surface import make_surface

LENGTHS = {"period": 100e-6, "rolloff_wavelength": 50e-6, "short_wavelength": 12e-6, "hurst": 0.8}
PROMISES = {
    "rms_height": {"rms_heights": ["200 nm", "2 um"]},
    "rms_slope": {"rms_slopes": [0.2, 1.0]},
    "measured": {"rms_slopes": "measured"},
}


@pytest.fixture
def runs(load, tmp_path, monkeypatch):
    """Return the promised values of the runs of a study, and their surfaces as the jobs make them."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))

    def made(kind, promise, amplitudes, boundary):
        spectrum = SelfAffineSpectrum(**LENGTHS, rms_slope=0.3)
        q = np.geomspace(2 * np.pi / 100e-6, 2 * np.pi / 12.001e-6, 400)
        SpectrumTable(q, spectrum.psd(q)).save(tmp_path / "table.txt")
        lengths = {name: value if name == "hurst" else f"{value} m" for name, value in LENGTHS.items()}
        section = lengths if kind == "self_affine" else {"path": "table.txt", "period": "100 um"}
        ((key, values),) = PROMISES[promise].items()
        rough = section | {"kind": kind, "grid": 80, "amplitudes": amplitudes, "boundary": boundary}
        study = {"studies.one.rms_slopes": None, f"studies.one.{key}": values, "studies.one.seeds": [1, 2, 3]}
        campaign = load({"surfaces.rough": rough, "materials.soft.surface_energy": "0 J/m^2"} | study).campaign
        table = str(tmp_path / "table.txt")
        heights = {"height_map": table, "sha256": campaign.topographies["rough"].sha256} if kind == "spectrum" else {}
        for case in campaign.all_runs:
            file = tmp_path / f"seed{case.seed}.nc"
            settings = surface_settings(campaign, "rough")
            make_surface(file, name="rough", seed=case.seed, settings=settings, attributes={}, **heights)
            scale = {k: v for k, v in run_settings(campaign, case).items() if k in ("rms_slope", "rms_height")}
            yield scale, read_scaled_surface(file, **scale)

    return lambda *choices: list(made(*choices))


@pytest.mark.parametrize(("amplitudes", "boundary"), [("fixed", "periodic"), ("gaussian", "free")])
@pytest.mark.parametrize("promise", PROMISES)
@pytest.mark.parametrize("kind", ["self_affine", "spectrum"])
def test_each_realisation_has_the_promised_height_or_slope(kind, promise, amplitudes, boundary, runs):
    if (kind, promise) == ("self_affine", "measured"):
        pytest.skip("a self-affine surface has no slope of its own")
    found = runs(kind, promise, amplitudes, boundary)
    assert len(found) == 3 * (1 if promise == "measured" else 2)
    for scale, surface in found:
        if promise == "rms_height":
            assert scale["rms_height"] in (200e-9, 2e-6)
            assert surface.rms_height == pytest.approx(scale["rms_height"], rel=1e-9)
            assert np.std(surface.heights) == pytest.approx(scale["rms_height"], rel=1e-9)
        else:
            assert surface.rms_slope == pytest.approx(0.3 if promise == "measured" else scale["rms_slope"], rel=5e-3)
    # The slopes of random amplitudes differ where heights are prescribed, and the other way round.
    free_quantity = [surface.rms_slope / surface.rms_height for _, surface in found]
    same = amplitudes == "fixed" and boundary == "periodic"
    assert (np.ptp(free_quantity) < 1e-6 * max(free_quantity)) == same
    # In the results, the label of a run is the slope of the spectrum.
    labels = sorted({scale["rms_slope"] for scale, _ in found})
    assert len(labels) == (1 if promise == "measured" else 2)


def test_runs_of_one_height_stand_side_by_side_in_the_dataset(runs):
    """The runs of a height have different slopes, so each seed has its own bins of pressures."""
    path, material = Path(reduced_pressures=[1e-3, 1e-2]), Material(25e6, 0.0)
    found = [
        (RunLabels("one", "asperities", "rough", seed, scale["rms_slope"], "soft"), simulate(surface, material, path))
        for seed, (scale, surface) in enumerate(runs("self_affine", "rms_height", "gaussian", "periodic")[::2])
    ]
    study = campaign_tree(found, attrs={"title": "Heights", "summary": "For tests."})["one"].to_dataset()
    np.testing.assert_allclose(study["rms_height"].squeeze(), 200e-9)
    slopes = np.sqrt(2 * study["spectral_moment_2"].squeeze().values)
    assert study.sizes["rms_slope"] == 1 and np.ptp(slopes) > 0.05 * slopes.max()
    # Relative loads p/E* are those of the runs, not of the label.
    load = compare_runs(study)["relative_load"].values
    pressure = study["nominal_pressure"].squeeze().values
    assert pressure.min() / 25e6 <= load.min() * (1 + 1e-9) and load.max() <= pressure.max() / 25e6 * (1 + 1e-9)
