"""The source of a deposit is what pip installed, file by file, and nothing else can be published."""

import hashlib
import re
from base64 import urlsafe_b64encode

import pytest

from icha.deposit.deposit_files import files_of
from icha.deposit.environment import MADE_WITH, note_versions, refuse_results_of_another_environment
from icha.deposit.installed_source import installed_source
from icha.deposit.source import program_source

FILES = {
    "icha/__init__.py": "",
    "icha/physics.py": "ONE = 1\n",
    "icha_workflow/Snakefile": "rule all:\n",
    "icha_workflow/uv.lock": "version = 1\n",
    "icha_workflow/workflow/rules/runs.smk": "rule run:\n",
    "snakemake_logger_plugin_icha/__init__.py": "",
}


@pytest.fixture
def place(tmp_path):
    """A folder as pip leaves it."""
    place = tmp_path / "site-packages"
    record = []
    for name, text in FILES.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
        digest = urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).decode().rstrip("=")
        record.append(f"{name},sha256={digest},{len(text)}")
    information = place / "icha-7.1.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.4\nName: icha\nVersion: 7.1\n")
    (information / "RECORD").write_text("\n".join([*record, "../../bin/icha,sha256=x,1", "icha/physics.pyc,,"]) + "\n")
    return place


def test_source_is_what_was_installed_in_its_places_in_the_repository(place, tmp_path):
    for cache in ("icha", "icha_workflow/workflow"):
        (place / cache / "__pycache__").mkdir()
        (place / cache / "__pycache__/physics.pyc").write_bytes(b"x")
    source = program_source(place / "icha_workflow")
    listed = "".join(
        f"{hashlib.sha256(FILES[name].encode()).hexdigest()}  {name}\n"
        for name in sorted(FILES)
        if name.startswith("icha")
    )
    assert source.revision == f"icha-7.1-{hashlib.sha256(listed.encode()).hexdigest()}"
    source.export(tmp_path / "export")
    assert {name: (tmp_path / "export" / name).read_text() for name in files_of(tmp_path / "export")} == {
        name.removeprefix("icha_workflow/"): text for name, text in FILES.items() if name.startswith("icha")
    }


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda p: (p / "icha/physics.py").write_text("ONE = 2\n"), "changed: icha/physics.py"),
        (lambda p: (p / "icha_workflow/Snakefile").unlink(), "changed: icha_workflow/Snakefile"),
        (lambda p: (p / "icha/more.py").write_text(""), "not of the installed version: icha/more.py"),
    ],
)
def test_another_program_than_what_was_installed_is_refused(place, spoil, said):
    spoil(place)
    with pytest.raises(ValueError, match=rf"differs from icha 7\.1(.|\n)*force-reinstall(.|\n)*{re.escape(said)}"):
        installed_source(place / "icha_workflow")


def test_a_folder_that_pip_knows_nothing_of_is_refused(place):
    (place / "icha-7.1.dist-info").rename(place / "other")
    with pytest.raises(ValueError, match="no distribution `icha` is installed here"):
        installed_source(place / "icha_workflow")


def test_results_that_were_made_with_other_versions_are_refused(tmp_path):
    results = tmp_path / "results/mine"
    (tmp_path / "uv.lock").write_text(
        'version = 1\n[[package]]\nname = "numpy"\nversion = "0.1"\nsource = { registry = "there" }\n'
    )
    refuse_results_of_another_environment(results, tmp_path)  # nothing is known of them
    results.mkdir(parents=True)
    (results / MADE_WITH).write_text("numpy==0.1\nother==3\n")
    refuse_results_of_another_environment(results, tmp_path)
    note_versions(results)  # those that are installed
    noted = (results / MADE_WITH).read_text().splitlines()
    assert "numpy==0.1" in noted and len([line for line in noted if line.startswith("numpy==")]) == 2
    with pytest.raises(ValueError, match=r"made with versions that are not those of uv\.lock(.|\n)*  numpy \d"):
        refuse_results_of_another_environment(results, tmp_path)
    written = (results / MADE_WITH).stat().st_mtime_ns
    note_versions(results)
    assert (results / MADE_WITH).stat().st_mtime_ns == written
