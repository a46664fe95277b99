"""Optional software that only some campaigns need, and the message without it."""

import os
import re
import subprocess
import sys

import pytest
import yaml
from conftest import REPOSITORY, snakemake_command

from icha.configuration.load import load_configuration
from icha.planning.requirements import BY_TAMAAS, further_software, missing_software

# Nothing of this name can be imported.
WITHOUT = "import sys\n\nsys.modules['tamaas'] = None\n"
VALIDATION = REPOSITORY / "config/campaigns/validation.yaml"


def without(section, tmp_path):
    """The campaign validation, of the sections of Tamaas with one only, or none."""
    content = yaml.safe_load(VALIDATION.read_text(encoding="utf-8"))
    for name in BY_TAMAAS:
        if name != section:
            content.pop(name, None)
    content.pop("figures")
    file = tmp_path / "one.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return load_configuration(file).campaign


@pytest.mark.parametrize("section", BY_TAMAAS)
def test_sections_of_tamaas_need_it(section, tmp_path, monkeypatch):
    campaign = without(section, tmp_path)
    assert further_software(campaign) == ("tamaas",)
    monkeypatch.setitem(sys.modules, "tamaas", None)
    assert re.match(rf"{section}: needs Tamaas, which is not installed; run `make tamaas` ", missing_software(campaign))


def test_campaigns_without_them_do_not(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "tamaas", None)
    campaign = without(None, tmp_path)
    assert further_software(campaign) == () and missing_software(campaign) is None


@pytest.mark.slow
def test_a_campaign_that_needs_it_is_refused_before_anything_is_computed(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(WITHOUT)
    command, environment = snakemake_command("-d", str(tmp_path), configuration=VALIDATION)
    environment["PYTHONPATH"] = os.pathsep.join([str(tmp_path), str(REPOSITORY)])
    done = subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True)
    assert done.returncode != 0
    assert "boundary_element_loops: needs Tamaas, which is not installed" in done.stderr
    assert "run `make tamaas` in a clone" in done.stderr and "Nothing was computed." in done.stderr
    assert not list((tmp_path / "results").rglob("*.nc"))
