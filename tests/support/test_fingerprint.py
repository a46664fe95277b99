"""A fingerprint depends on the modules that compute a result, and on nothing else."""

import sys
import time
from pathlib import Path

import pytest
from conftest import REPOSITORY

from icha.contact.models import MODELS
from icha.support import fingerprint as fingerprints
from icha.support.fingerprint import fingerprint, imported_modules

SURFACE, RUN, THEORIES = "icha.tasks.surface", "icha.tasks.run", "icha.tasks.theories"
RUNS = (RUN, *(model.module for model in MODELS.values()))


def test_fingerprints_contain_the_modules_that_a_task_uses():
    used = {task: set(imported_modules(*modules)) for task, modules in
            {SURFACE: (SURFACE,), RUN: RUNS, THEORIES: (THEORIES,)}.items()}  # fmt: skip
    for module, tasks in {
        "boundary_elements.contact": {RUN},
        "equilibrium.newton": {RUN},
        "asperity.jkr": {RUN, THEORIES},
        "simulation": {RUN},
        "references.persson": {THEORIES},
        "surfaces.spectrum": {SURFACE, THEORIES},
        "datasets.files": {SURFACE, RUN, THEORIES},
        "support.atomic_files": {SURFACE, RUN, THEORIES},
        "configuration.campaign": set(),
        "datasets.stamp": set(),
        "figures.style": set(),
        "report.report": set(),
        "support.fingerprint": set(),
    }.items():
        assert {task for task, modules in used.items() if f"icha.{module}" in modules} == tasks, module


def test_scripts_count_with_the_modules_that_they_import(tmp_path):
    script = tmp_path / "script.py"
    prints = {}
    for text in (
        "",
        "import icha.figures.style\n",
        "from icha.figures import style\n",
        "from icha.figures.style import x\n",
    ):
        script.write_text(text)
        fingerprints._checksum_of.cache_clear()
        fingerprint.cache_clear()
        prints[text] = fingerprint(script=script)
    assert len(set(prints.values())) == len(prints)
    script.write_text("from icha import simulate\n")
    fingerprint.cache_clear()
    with pytest.raises(ValueError, match="from the module that defines it"):
        fingerprint(script=script)
    assert "icha.figures.style" in {*imported_modules("icha.figures.registry")}
    draws = REPOSITORY / "workflow/scripts/draw_figures.py"
    assert fingerprint("icha.figures.one_asperity", script=draws) != fingerprint("icha.figures.loops", script=draws)


@pytest.fixture
def checksum(tmp_path):
    """Return a function that writes a module and returns its checksum."""

    def of(text):
        module = tmp_path / "module.py"
        module.write_text(text)
        fingerprints._checksum_of.cache_clear()
        return fingerprints._checksum_of(module)

    return of


MODULE = '"""Docstring."""\nNAME = "data.csv"\n\n\ndef f(x):\n    """Return x."""\n    return x + 1\n'


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("Return x.", "Return more.", True),
        ("return x + 1", "return x+1  # a comment", True),
        ('    """Return x."""\n', "", True),
        ('"""Docstring."""\n', "", True),
        ("x + 1", "x + 2", False),
        ("NAME", "OTHER", False),
    ],
)
def test_comments_docstrings_and_formatting_do_not_count(old, new, same, checksum):
    assert old in MODULE
    assert (checksum(MODULE) == checksum(MODULE.replace(old, new))) == same


def test_a_data_file_counts_if_a_module_beside_it_names_it(checksum, tmp_path):
    first = checksum(MODULE)
    (tmp_path / "other.csv").write_text("1")
    assert checksum(MODULE) == first
    (tmp_path / "data.csv").write_text("1")
    second = checksum(MODULE)
    (tmp_path / "data.csv").write_text("2")
    assert len({first, second, checksum(MODULE)}) == 3
    (tmp_path / "NAMES").mkdir()
    (tmp_path / "NAMES/table.txt").write_text("1")
    third = checksum(MODULE.replace("data.csv", "NAMES"))
    (tmp_path / "NAMES/table.txt").write_text("2")
    assert checksum(MODULE.replace("data.csv", "NAMES")) != third
    (tmp_path / "NAMES/__init__.py").touch()  # a package, whose name is a word of the module by chance
    assert checksum(MODULE.replace("data.csv", "NAMES")) not in (third, second)


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc/uptime")
def test_files_of_the_system_that_a_module_names_are_not_part_of_it(checksum):
    text = "UPTIME = '/proc/uptime'\n"
    first, before = checksum(text), Path("/proc/uptime").read_text()
    while Path("/proc/uptime").read_text() == before:
        time.sleep(0.01)
    assert checksum(text) == first
