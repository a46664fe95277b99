"""Topographies that others have published, from their files to figures, by both models."""

import hashlib
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from conftest import REPOSITORY, modules_of

from icha.configuration.load import load_configuration
from icha.surfaces.measured.resolution import examine_scan

DATA = REPOSITORY / "tests/data"
CAMPAIGN = DATA / "published_topographies.yaml"
SURFACES = load_configuration(CAMPAIGN).campaign.surfaces


def test_the_files_are_those_that_their_origin_is_told_of():
    told = dict(re.findall(r"^\| `([^`]+)`.*`([0-9a-f]{64})` \|$", (DATA / "README.md").read_text(), re.MULTILINE))
    there = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in (DATA / "topographies").iterdir()}
    assert told == there


@pytest.mark.parametrize("name", SURFACES)
def test_their_summits_are_resolved_as_they_are_used(name):
    scan = examine_scan(SURFACES[name].path, SURFACES[name].preparation)
    assert scan.cells_per_summit > 80
    assert "cutoff" not in scan.advice


@pytest.mark.slow
def test_every_file_becomes_contact_by_both_models_and_figures(tmp_path):
    """More contact at more load, and by both models the same to a factor of two."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(REPOSITORY / "Snakefile"), "--directory"]
    command += [str(tmp_path), "--cores", "2", "all", "--configfile", str(CAMPAIGN)]
    environment = os.environ | {"PYTHONPATH": modules_of(REPOSITORY), "PYTHONDONTWRITEBYTECODE": "1"}
    run = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert run.returncode == 0, run.stdout
    results, pressed = tmp_path / "results/published_topographies", set()
    with xr.open_datatree(results / "dataset/published_topographies.nc") as campaign:
        for study in campaign.children.values():
            runs = study.to_dataset()
            for own in runs.surface.values:
                for material in runs.material.values:
                    at = runs.sel(surface=own, material=material)
                    area = at["contact_area_fraction"].values.reshape(len(at.model), -1, len(at.step))
                    known = area[np.isfinite(area)].reshape(len(at.model), len(at.step))
                    assert np.all(np.diff(known, axis=1) > 0) and np.all((known > 0) & (known < 0.5))
                    if len(known) == 2:
                        assert np.all(np.abs(np.log2(known[0] / known[1])) < 1)
                    pressed.add(str(own))
    assert pressed == set(SURFACES)
    names = {"fig2_area_and_gap", "fig3_distributions", "fig4_contact_map", "fig5_multi_slope", "fig10_model_error"}
    assert names <= {file.stem for file in (results / "figures").glob("*.png")}
    report = (results / "report.html").read_text()
    for name, words in {
        "optical": "Gaussian S-filter (ISO 16610-61) with a nesting index of 4e-06 m",
        "oblong_pixels": "square ones, by the cosine series along y",
        "with_holes": "missing points filled",
    }.items():
        assert words in report
        with xr.open_dataset(results / f"surfaces/{name}/seed0.nc") as surface:
            assert words in surface.attrs["preparation"]
