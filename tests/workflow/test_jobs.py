"""Jobs: log and errors, batches, files of users; the folder of results before jobs start."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from conftest import REPOSITORY

from icha.datasets.files import read_dataset, write_dataset
from icha.datasets.stamp import NAMES, read_stamp
from icha.datasets.surface_file import read_surface
from icha.support.checksums import sha256_of
from icha.surfaces.shapes import make_shape
from icha.tasks.surface import make_surface

SCRIPT = f"""
import sys
from types import SimpleNamespace
sys.path.insert(0, {str(REPOSITORY / "workflow/scripts")!r})
from job import job_context
with job_context(SimpleNamespace(log=[sys.argv[1]])):
    print("at work", flush=True)
"""


def run_job(work, log):
    """Run a job; return its status and its error output."""
    done = subprocess.run([sys.executable, "-c", f"{SCRIPT}    {work}\n", str(log)], capture_output=True, text=True)
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("work", "status", "printed", "has_traceback"),
    [
        ("print('done')", 0, "done", False),
        ("raise ValueError('wrong input')", 1, "Error: wrong input", False),
        ("raise KeyError('a')", 1, "Error: unexpected KeyError('a')", True),
    ],
)
def test_output_and_errors_of_a_job_are_in_its_log(work, status, printed, has_traceback, tmp_path):
    assert run_job(work, tmp_path / "job.log") == (status, "")
    assert (tmp_path / "job.log").read_text().splitlines()[:2] == ["at work", printed]
    assert (tmp_path / "job.log.traceback").exists() == has_traceback


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_errors_go_to_the_terminal_if_the_log_cannot_be_written(tmp_path):
    (tmp_path / "full.log").symlink_to("/dev/full")
    status, output = run_job("open('result', 'w')", tmp_path / "full.log")
    assert status == 1
    assert output.removeprefix("at work\n") == "Error: [Errno 28] No space left on device\n"


@pytest.fixture
def batch(monkeypatch, tmp_path):
    """Return a function that computes a batch of three files with given stamps; it returns the computed names."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))
    from job import compute_batch

    def compute(*programs, failing=None, present=None):
        computed = []

        def task(output, attributes):
            if output == failing:
                raise OSError(28, "No space left on device")
            computed.append(Path(output).stem)
            write_dataset(DATASET.assign_attrs(attributes), output)

        outputs = [str(tmp_path / f"{name}.nc") for name in "abc"]
        stamps = [dict.fromkeys(NAMES, "same") | {"program_sha256": program} for program in programs]
        arguments = [{"attributes": stamp} for stamp in stamps]
        try:
            compute_batch(
                outputs, arguments, task, lambda each: present or each["attributes"]["program_sha256"], "same"
            )
        except OSError:
            computed.append("failed")
        return computed

    return compute


DATASET = xr.Dataset({"value": ((), 1.0, {"units": "1"})})


def test_a_batch_computes_only_files_without_the_expected_stamp(batch, tmp_path):
    # Files before an error of the machine are kept.
    assert batch("1", "1", "1", failing=str(tmp_path / "b.nc")) == ["a", "failed"]
    assert batch("1", "1", "1") == ["b", "c"]
    with pytest.raises(ValueError, match="the program has changed since the campaign started; repeat the command"):
        batch("1", "1", "1", present="2")
    assert batch("1", "1", "1") == []
    assert batch("1", "2", "1") == ["b"]
    os.truncate(tmp_path / "c.nc", (tmp_path / "c.nc").stat().st_size // 2)
    (tmp_path / "a.nc").unlink()
    assert batch("1", "2", "1") == ["a", "c"]


@pytest.fixture
def prepare(monkeypatch, tmp_path):
    """The module `workflow/prepare.py`, in an empty working directory."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow"))
    monkeypatch.chdir(tmp_path)
    import prepare

    yield prepare
    while prepare.locks:
        prepare.locks.pop().close()


RESULT = "results/tiny/report.html"
PATH, STAMP = "results/tiny/run.nc", dict.fromkeys(NAMES, "new")


@pytest.mark.parametrize(
    ("arguments", "dry_run", "removed"),
    [
        ([], False, True),
        (["all", "--cores", "2", "--report-after-run", "--configfile", "a/all.yaml", RESULT], False, True),
        ([], True, False),
        (["--touch"], False, False),
        (["--report", "page.html"], False, False),
        (["--report=page.html"], False, False),
        (["--list-changes", "code"], False, False),
        (["-S"], False, False),
    ],
)
def test_outdated_files_are_removed_if_jobs_will_run(arguments, dry_run, removed, prepare, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["snakemake", *arguments])
    assert prepare.targets_of(sys.argv) == [each for each in arguments if each in ("all", RESULT)]
    Path(PATH).parent.mkdir(parents=True)
    write_dataset(DATASET.assign_attrs(STAMP), PATH)
    prepare.Results("results/tiny", "tiny.yaml", {PATH: STAMP}, dry_run=dry_run)
    assert Path(PATH).exists()
    for lock in prepare.locks:
        lock.close()
    prepare.Results("results/tiny", "tiny.yaml", {PATH: STAMP | {"config_sha256": "other"}}, dry_run=dry_run)
    assert Path(PATH).exists() != removed


def test_another_licence_is_stated_without_computing(prepare):
    Path(PATH).parent.mkdir(parents=True)
    write_dataset(DATASET.assign_attrs(STAMP), PATH)
    other = STAMP | {"license": "CC0-1.0"}
    prepare.Results("results/tiny", "tiny.yaml", {PATH: other})
    assert read_stamp(PATH) == other and read_dataset(PATH).equals(DATASET)


def test_two_calls_at_once_and_temporary_files_of_killed_calls(prepare):
    left = Path("results/tiny/publish/.tiny-1.0.0.zip.0a1b2c3d.part")
    left.parent.mkdir(parents=True)
    left.write_bytes(b"a part")
    assert prepare.hold_lock(".snakemake/tiny.lock") is None
    with pytest.raises(SystemExit, match=f"Process {os.getpid()} is running this campaign"):
        prepare.Results("results/tiny", "tiny.yaml", {}).begin()
    assert left.exists()
    prepare.locks.pop().close()
    prepare.Results("results/tiny", "tiny.yaml", {}).begin()
    assert not left.exists()


@pytest.mark.parametrize("dry_run", [False, True])
def test_results_of_another_configuration_of_the_same_name_are_refused(dry_run, prepare):
    Path("tiny.yaml").touch()
    prepare.Results("results/tiny", "tiny.yaml", {}).begin()
    assert Path("results/tiny/belongs_to.txt").read_text() == "tiny.yaml\n"
    with pytest.raises(SystemExit, match=r"copy\.yaml has the same `name: tiny`"):
        prepare.Results("results/tiny", "copy.yaml", {}, dry_run=dry_run)


@pytest.mark.parametrize("link", [True, False])
def test_places_without_room_for_results_are_named(link, prepare, tmp_path, monkeypatch):
    Path("results").symlink_to("nowhere") if link else Path("results").write_text("something else")
    with pytest.raises(SystemExit, match="results/tiny cannot be written to: instead of a folder there is"):
        prepare.Results("results/tiny", "tiny.yaml", {}).begin()
    (tmp_path / "a\\b").mkdir()
    monkeypatch.chdir(tmp_path / "a\\b")
    with pytest.raises(SystemExit, match="has a backslash"):
        prepare.Results("results/tiny", "tiny.yaml", {}).begin()


def test_a_file_that_changed_after_its_inspection_is_neither_used_nor_copied(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))
    from write_configuration import write_configuration

    file, surface, copy = (tmp_path / name for name in ("heights.npy", "surface.nc", "copy.npy"))
    settings = {"kind": "file", "period": 1e-3, "metres_per_unit": 1e-6}

    def both(sha256):
        make_surface(
            surface, name="own", seed=0, settings=settings, height_map=file, sha256=sha256, attributes={"campaign": "a"}
        )
        write_configuration(tmp_path / "used.yaml", text="name: a", copies={copy: file}, sha256=[sha256])

    np.save(file, np.random.default_rng(1).normal(size=(16, 16)))
    inspected = sha256_of(file)
    both(inspected)
    assert copy.read_bytes() == file.read_bytes() and surface.exists()
    surface.unlink()
    np.save(file, np.random.default_rng(2).normal(size=(16, 16)))
    with pytest.raises(ValueError, match=r"heights\.npy has changed since the campaign started; repeat the command"):
        both(inspected)
    with pytest.raises(ValueError, match=r"heights\.npy has changed"):
        write_configuration(tmp_path / "used.yaml", text="name: a", copies={copy: file}, sha256=[inspected])
    assert not surface.exists() and sha256_of(copy) == inspected


def test_the_file_of_a_surface_keeps_the_shape_and_scales_the_roughness_alone(tmp_path):
    rough = {"kind": "self_affine", "period": 4e-4, "rolloff_wavelength": 1e-4, "short_wavelength": 5e-5, "hurst": 0.8}
    rough |= {"grid": 64, "amplitudes": "fixed"}
    smooth = {"kind": "smooth", "side": 4e-4, "grid": 64}
    for shape in ({"sphere": {"radius": 1e-3}}, {"paraboloid": {"radii": [1e-3, 2e-3]}}):
        for settings, slope in ((rough, 1.0), (smooth, 0.0)):
            file = tmp_path / "surface.nc"
            free = settings | {"boundary": "free", "shape": shape}
            make_surface(file, name="own", seed=1, settings=free, attributes={"campaign": "a"})
            surface = read_surface(file)
            assert surface.free and surface.shape == make_shape(shape) and surface.period == 4e-4
            assert surface.rms_slope == pytest.approx(slope, rel=1e-12)
            # At another slope the shape stays as it is.
            other = surface.scaled_to_rms_slope(slope / 50)
            assert other.rms_slope == pytest.approx(slope / 50, rel=1e-12)
            np.testing.assert_allclose(other.profile - other.heights, surface.profile - surface.heights, atol=1e-18)
            file.unlink()


def test_files_of_the_working_directory_do_not_replace_modules(tmp_path, monkeypatch):
    clone, folder, named = (tmp_path / name for name in ("clone", "folder", "named"))
    folder.mkdir()
    own, installed = "/home/anna/.local/lib/python3/site-packages", "/usr/lib/python3/dist-packages"
    monkeypatch.chdir(folder)
    monkeypatch.setenv("PYTHONPATH", f"{named}{os.pathsep}")
    monkeypatch.setattr(sys, "path", [str(clone), "", str(folder), str(named), own, installed])
    first = (REPOSITORY / "Snakefile").read_text(encoding="utf-8").partition("from snakemake")[0]
    exec(first, {"workflow": SimpleNamespace(current_basedir=clone)})
    assert sys.path == [str(named), own, installed, str(clone), "", str(folder)]
    # Folders that PYTHONPATH names keep their places.
    monkeypatch.setenv("PYTHONPATH", str(clone))
    monkeypatch.setattr(sys, "path", [str(folder), str(clone), installed])
    exec(first, {"workflow": SimpleNamespace(current_basedir=clone)})
    assert sys.path == [str(clone), installed, str(folder)]


def test_a_full_disk_is_reported_as_such_by_netcdf_files(tmp_path):
    # A limit of file sizes stands for the full disk. The netCDF library reports both as "HDF error".
    code = f"""
import resource, sys
import numpy as np, netCDF4
from icha.support.atomic_files import whole_file
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
with whole_file({str(tmp_path / "folder/large.nc")!r}) as temporary:
    with netCDF4.Dataset(temporary, "w") as data:
        data.createDimension("x", 100000)
        data.createVariable("y", "f8", ("x",))[:] = np.arange(100000.0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=REPOSITORY)
    assert f"OSError: [Errno 27] File too large: '{tmp_path}/folder'" in done.stderr.splitlines()[-1]
    assert list((tmp_path / "folder").iterdir()) == []
