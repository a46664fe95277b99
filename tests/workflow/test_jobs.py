"""Every job records its results, checks its inputs, writes a log, and ends with Snakemake."""

import json
import os
import signal
import subprocess
import sys
from base64 import urlsafe_b64encode
from multiprocessing import spawn
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import REPOSITORY, is_alive, wait_for

from icha.datasets.surface_file import read_surface
from icha.support.atomic_files import take_over, whole_file
from icha.support.checksums import (
    hash_parameters,
    is_whole,
    recorded_hash,
    sha256_of,
    with_sidecar,
    write_checksum,
)
from icha.support.program import beginning_of
from icha.surfaces.shapes import make_shape

RESULTS = "results/tiny"
SCRIPT = f"""
import sys
from types import SimpleNamespace
sys.path.insert(0, {str(REPOSITORY / "workflow/scripts")!r})
from job import job_context
snakemake = SimpleNamespace(
    input=["{RESULTS}/surfaces/a.nc", "elsewhere.txt"], output=["{RESULTS}/runs/b.nc"], log=[sys.argv[1]],
    params=[{{"seed": 1}}, "code"],
)
with job_context(snakemake):
    print("at work", flush=True)
"""
WORK = f"    open('{RESULTS}/runs/b.nc', 'w').write('a result')\n"


@pytest.fixture
def job(tmp_path):
    """Start a job with one input in a folder of results."""
    for folder in ("surfaces", "runs", "logs"):
        (tmp_path / RESULTS / folder).mkdir(parents=True)
    (tmp_path / RESULTS / "surfaces/a.nc").write_bytes(b"heights")
    write_checksum(tmp_path / RESULTS, "surfaces/a.nc")

    def start(work, log="logs/b.log", before="", **environment):
        return subprocess.Popen(
            [sys.executable, "-c", before + SCRIPT + work, f"{RESULTS}/{log}"],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(REPOSITORY)} | environment,
            stderr=subprocess.PIPE,
            text=True,
        )

    start.results = tmp_path / RESULTS
    return start


def ended(process):
    """Return the status and the error output of a job."""
    output = process.communicate(timeout=60)[1]
    return process.returncode, output


def test_a_job_records_its_result_and_its_settings_even_if_it_changes_them(job):
    assert ended(job(f"{WORK}    snakemake.params[0].clear()\n")) == (0, "")
    assert json.loads((job.results / "checksums/runs/b.nc.json").read_text())["size"] == len("a result")
    assert (job.results / "logs/b.log").read_text() == "at work\n"
    assert recorded_hash(job.results, "runs/b.nc") == hash_parameters([repr({"seed": 1}), repr("code")])


def test_the_result_of_a_failed_job_is_computed_again(job):
    (job.results / "runs/b.nc").write_text("a former result")
    write_checksum(job.results, "runs/b.nc")
    (job.results / "runs/b.nc").unlink()
    assert ended(job("    raise ValueError('wrong input')\n"))[0] == 1
    assert (job.results / "logs/b.log").read_text() == "at work\nError: wrong input\n"
    assert "runs/b.nc" in with_sidecar(job.results) and not (job.results / "runs/b.nc").exists()


def test_a_job_refuses_a_damaged_input_and_records_the_damage(job):
    file = job.results / "surfaces/a.nc"
    before = file.stat()
    file.write_bytes(b"hexghts")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert is_whole(job.results, "surfaces/a.nc")
    assert ended(job(WORK))[0] == 1
    log = (job.results / "logs/b.log").read_text()
    assert log.startswith(f"Error: {RESULTS}/surfaces/a.nc: does not match its checksum") and "at work" not in log
    assert not (job.results / "runs/b.nc").exists()
    assert not is_whole(job.results, "surfaces/a.nc")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_errors_go_to_the_terminal_if_the_log_cannot_be_written(job):
    (job.results / "logs/full.log").symlink_to("/dev/full")
    status, output = ended(job(WORK, log="logs/full.log"))
    assert status == 1
    assert output.removeprefix("at work\n") == "Error: [Errno 28] No space left on device\n"


def test_a_job_ends_when_its_snakemake_ends(job):
    snakemake = subprocess.Popen(["sleep", "600"])
    told = f"{snakemake.pid} {beginning_of(snakemake.pid)}"
    process = job(f"    import time\n{WORK}    time.sleep(600)\n", ICHA_SNAKEMAKE=told)
    wait_for((job.results / "runs/b.nc").exists)
    assert process.poll() is None
    snakemake.send_signal(signal.SIGKILL)
    snakemake.wait()
    assert ended(process) == (1, "")


@pytest.mark.parametrize("reused", [False, True])
def test_a_job_whose_snakemake_ended_before_writes_nothing(job, reused):
    snakemake = subprocess.Popen(["true"])
    told = f"{snakemake.pid} {beginning_of(snakemake.pid)}"
    snakemake.wait()
    if reused:
        told = f"{os.getpid()} 1"
    assert ended(job(WORK, ICHA_SNAKEMAKE=told)) == (1, "")
    assert not (job.results / "runs/b.nc").exists() and "runs/b.nc" not in with_sidecar(job.results)


def test_a_busy_job_is_killed_when_its_snakemake_is_killed(job, tmp_path):
    busy = "    import re\n    re.match('(a?){60}b', 'a' * 60)  # blocks the interpreter for years\n"
    (tmp_path / "busy.py").write_text(SCRIPT + WORK + busy)
    caller = f"""
import os, subprocess, sys
sys.path.insert(0, {str(REPOSITORY)!r})
from icha.support.program import beginning_of
os.environ["ICHA_SNAKEMAKE"] = f"{{os.getpid()}} {{beginning_of(os.getpid())}}"
process = subprocess.Popen([sys.executable, "busy.py", "{RESULTS}/logs/b.log"])
print(process.pid, flush=True)
process.wait()
"""
    snakemake = subprocess.Popen([sys.executable, "-c", caller], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    busy = int(snakemake.stdout.readline())
    wait_for((job.results / "runs/b.nc").exists)
    snakemake.kill()
    snakemake.wait()
    wait_for(lambda: not is_alive(busy), seconds=30)  # far less than the work would take


def test_a_job_of_an_earlier_call_cannot_complete_a_result_of_a_later_call(job, tmp_path, monkeypatch):
    owner = tmp_path / ".snakemake/tiny.owner"
    monkeypatch.setenv("ICHA_OWNER", "")
    take_over(owner)
    # The job of the earlier call writes 25 MPa. Before it completes the file, a later call writes 30 MPa.
    write = f"""
    from icha.support.atomic_files import whole_file
    with whole_file('{RESULTS}/runs/b.nc') as temporary:
        temporary.write_text('25 MPa')
        print('half way', flush=True)
        import pathlib, time
        while not pathlib.Path('go on').exists():
            time.sleep(0.02)
"""
    orphan = job(write)
    wait_for(lambda: "half way" in (job.results / "logs/b.log").read_text(errors="replace"))
    take_over(owner)
    later = write.replace("25 MPa", "30 MPa").replace("while not", "while False and not")
    assert ended(job(later, log="logs/later.log")) == (0, "")
    (tmp_path / "go on").touch()
    assert ended(orphan)[0] == 1
    assert "a later call of this campaign owns this result" in (job.results / "logs/b.log").read_text()
    assert (job.results / "runs/b.nc").read_text() == "30 MPa" and is_whole(job.results, "runs/b.nc", thorough=True)
    assert [file.name for file in (job.results / "runs").iterdir()] == ["b.nc"]


def campaign(before_jobs, *, dry_run=False):
    return before_jobs.CampaignResults(RESULTS, "tiny", "tiny.yaml", "clone", dry_run=dry_run)


def test_only_a_call_that_starts_jobs_takes_over_the_results(job, tmp_path, monkeypatch, before_jobs):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)  # as on a file system without locks
    monkeypatch.setenv("ICHA_OWNER", "")
    take_over(".snakemake/tiny.owner")
    earlier = os.environ["ICHA_OWNER"]
    own = campaign(before_jobs)
    assert ended(job(WORK, ICHA_OWNER=earlier)) == (0, "")
    # A call that starts jobs takes over, unless the results have changed since they were inspected.
    (job.results / "runs/b.nc").write_text("another result")
    with pytest.raises(SystemExit, match=r"runs/b\.nc has changed while"):
        own.begin()
    (job.results / "runs/b.nc").unlink()
    own.begin()
    # A late job of the earlier call changes neither the result nor its record.
    assert ended(job(WORK)) == (0, "")
    record = (job.results / "checksums/runs/b.nc.json").read_bytes()
    assert ended(job(WORK.replace("a result", "another result"), ICHA_OWNER=earlier))[0] == 1
    assert (job.results / "checksums/runs/b.nc.json").read_bytes() == record
    assert (job.results / "runs/b.nc").read_text() == "a result"


@pytest.mark.parametrize("link", [True, False])
def test_a_file_or_a_broken_link_instead_of_the_results_is_named(link, tmp_path, monkeypatch, before_jobs):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)
    Path("results").symlink_to("nowhere") if link else Path("results").write_text("something else")
    with pytest.raises(SystemExit, match="results/tiny cannot be written to: instead of a folder there is"):
        campaign(before_jobs)


def test_a_file_that_changed_after_its_inspection_is_neither_used_nor_copied(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))
    from make_surface import make_surface
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


def test_the_file_of_a_surface_keeps_the_shape_and_scales_the_roughness_alone(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "workflow/scripts"))
    from make_surface import make_surface

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


def test_only_shell_commands_get_the_path_of_python_in_quotes(monkeypatch, before_jobs):
    own = sys.executable
    for name in ("ICHA_SNAKEMAKE", "PYTHONSAFEPATH"):
        monkeypatch.setenv(name, "")
    try:
        monkeypatch.setattr(sys, "executable", "/it's a folder/python")
        before_jobs.prepare_process()
        shell = subprocess.run(f"printf %s {sys.executable}", shell=True, capture_output=True, text=True).stdout
        assert shell == "/it's a folder/python" == os.fsdecode(spawn.get_executable())
    finally:
        spawn.set_executable(own)


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


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_content_name_and_record_of_a_result_reach_the_disk_in_this_order(job, monkeypatch):
    done = []
    sync, replace = os.fsync, os.replace
    named = {"runs": "folder", "b.nc": "result", "b.nc.json": "record"}

    def what(path):
        name = Path(path).name
        return named.get(name, named.get(name[1:-14]))  # a temporary file counts as its target

    monkeypatch.setattr(
        os, "fsync", lambda file: done.append(("sync", what(os.readlink(f"/proc/self/fd/{file}")))) or sync(file)
    )
    monkeypatch.setattr(os, "replace", lambda a, b: done.append(("name", what(b))) or replace(a, b))
    with whole_file(job.results / "runs/b.nc") as temporary:
        temporary.write_text("a result")
    write_checksum(job.results, "runs/b.nc")
    result = [("sync", "result"), ("name", "result"), ("sync", "folder")]
    assert done == [*result, ("sync", "record"), ("name", "record"), ("sync", "folder")]


@pytest.mark.parametrize("exists", [True, False], ids=["with_its_result", "alone"])
def test_a_damaged_record_of_snakemake_is_removed(exists, tmp_path, monkeypatch, before_jobs):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(before_jobs, "hold_lock", lambda path: None)
    result = Path(RESULTS, "b.nc")
    aside = result.with_name("b.nc.damaged")
    record = Path(".snakemake/metadata", urlsafe_b64encode(str(result).encode()).decode())
    for file, content in ((result, b"a result"), (record, b'{"rule": "run"\xfd')):
        file.parent.mkdir(parents=True)
        file.write_bytes(content)
    if not exists:
        result.unlink()
    campaign(before_jobs, dry_run=True)
    assert record.exists() and result.exists() == exists
    campaign(before_jobs)
    assert not record.exists() and not result.exists()
    assert (aside.read_bytes() == b"a result") if exists else not aside.exists()
