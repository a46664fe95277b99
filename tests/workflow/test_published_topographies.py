"""Published topographies of others, from their files to contact with both models."""

import hashlib
import re

import numpy as np
import pytest
from conftest import REPOSITORY

from icha.asperity.material import Material
from icha.configuration.cases import run_settings
from icha.configuration.load import load_configuration
from icha.path.targets import Path
from icha.simulation import simulate
from icha.surfaces.measured.resolution import examine_scan
from icha.surfaces.measured.topography import prepared_topography
from icha.surfaces.resolution import LEAST_CELLS, resolution_of

DATA = REPOSITORY / "tests/data"
CAMPAIGN = load_configuration(DATA / "published_topographies.yaml").campaign
SURFACES = CAMPAIGN.surfaces


def test_the_origin_of_every_file_is_listed():
    listed = dict(re.findall(r"^\| `([^`]+)`.*`([0-9a-f]{64})` \|$", (DATA / "README.md").read_text(), re.MULTILINE))
    present = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in (DATA / "topographies").iterdir()}
    assert listed == present


@pytest.mark.parametrize("name", SURFACES)
def test_their_shortest_waves_are_resolved(name):
    scan = examine_scan(SURFACES[name].path, SURFACES[name].preparation)
    assert resolution_of(scan.surface).cells > LEAST_CELLS
    assert "cutoff" not in scan.advice


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_every_file_gives_contact_with_both_models(name):
    """More load gives more contact area; both models agree within a factor of two."""
    surface = prepared_topography(SURFACES[name].path, SURFACES[name].preparation).surface
    areas = {}
    for case in (case for case in CAMPAIGN.all_runs if case.surface == name):
        settings = run_settings(CAMPAIGN, case)
        scaled = surface.scaled_to_rms_slope(case.rms_slope)
        run = simulate(scaled, Material(**settings["material"]), Path(**settings["path"]), model=case.model)
        area = run["contact_area_fraction"].values
        assert np.all(np.diff(area) > 0) and np.all((area > 0) & (area < 0.5)), case
        areas.setdefault(case.material, []).append(area)
    for area, *others in areas.values():
        assert all(np.all(np.abs(np.log2(other / area)) < 1) for other in others)
