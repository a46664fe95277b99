"""How files are best kept: size, and processor time to write and to read, of the ways that netCDF-4 has, side by side.

    python benchmarks/storage.py [--quick]

A run, surfaces of 512² and 2048² nodes and a campaign dataset of 64 runs are made by the package and copied, value for
value, once for each way; the shortest of three times counts. `kept` is what the package does. `contiguous`: variables
are neither compressed nor cut into chunks. `zlib`: at a level, on the chunks that the package or the netCDF library
chooses, or on those named; arrays of at least as many values as the package compresses, if no other number is named.
`zstd` needs a plug-in of the library that reads.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import netCDF4
import numpy as np

import icha
from icha.datasets.campaign_file import write_campaign
from icha.datasets.files import write_dataset
from icha.datasets.labels import RunLabels
from icha.datasets.results import LEAST_COMPRESSED
from icha.datasets.surface_file import write_surface

REPEATS = 3
SPECTRUM = icha.SelfAffineSpectrum(
    period=100e-6, rolloff_wavelength=20e-6, short_wavelength=100e-6 / 64, hurst=0.8, rms_slope=1.0
)
MATERIAL = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=2.071e-9)
RUNS = 64


def chunks_of(size: int) -> Callable[[tuple[int, ...]], tuple[int, ...]]:
    """Chunks of at most so many values: whole along the last dimensions, as far as they go."""

    def chunks(shape):
        left, found = size, []
        for length in reversed(shape):
            found.append(max(1, min(length, left)))
            left //= found[-1]
        return tuple(reversed(found))

    return chunks


def square(side: int) -> Callable[[tuple[int, ...]], tuple[int, ...]]:
    """Chunks that are as wide as they are long in the last two dimensions."""
    return lambda shape: tuple([1] * (len(shape) - 2) + [min(side, length) for length in shape[-2:]])


def zlib(level: int, **more) -> dict:
    """Settings of zlib with the shuffle filter."""
    return {"compression": "zlib", "complevel": level, "shuffle": True} | more


WAYS: dict[str, dict] = {
    "contiguous": {"contiguous": True},
    "zlib 1": zlib(1),
    "zlib 4": zlib(4),
    "zlib 9": zlib(9),
    "zlib 4 from 1024 values on": zlib(4, least=1024),
    "zlib 4 from 256 values on": zlib(4, least=256),
    "zlib 4 from 64 values on": zlib(4, least=64),
    "fletcher32 on all arrays, zlib 4": zlib(4, fletcher32=True, least=2),
    "zlib 4 without shuffle": zlib(4, shuffle=False),
    "zlib 4, fletcher32": zlib(4, fletcher32=True),
    "fletcher32 alone": {"fletcher32": True},
    "zlib 4, 8 Ki values": zlib(4, chunks=chunks_of(2**13)),
    "zlib 4, 64 Ki values": zlib(4, chunks=chunks_of(2**16)),
    "zlib 4, 1 Mi values": zlib(4, chunks=chunks_of(2**20)),
    "zlib 4, squares of 256": zlib(4, chunks=square(256)),
    # netCDF4 for Python shuffles for zlib only.
    "zstd 3, not shuffled": {"compression": "zstd", "complevel": 3},
}


def copied(source: Path, target: Path, way: dict | None) -> float:
    """Copy a file, kept in another way (in its own if None); seconds of processor that writing took."""
    with netCDF4.Dataset(source) as old:
        content = [(group, {name: values(v) for name, v in group.variables.items()}) for group in groups(old)]
        begin = time.process_time()
        with netCDF4.Dataset(target, "w") as new:
            new.set_fill_off()
            pending = []
            for group, own in content:
                place = new if group.path == "/" else new.createGroup(group.path)
                place.setncatts(group.__dict__)
                for name, dimension in group.dimensions.items():
                    place.createDimension(name, dimension.size)
                pending += [(defined(place, group[name], way), own[name]) for name in own]
            for variable, array in pending:
                variable[...] = array
        return time.process_time() - begin


def groups(data: netCDF4.Dataset) -> Iterator[netCDF4.Dataset]:
    """A file and all groups in it."""
    yield data
    for group in data.groups.values():
        yield from groups(group)


def values(variable: netCDF4.Variable) -> np.ndarray:
    """All values as they are kept."""
    variable.set_auto_maskandscale(False)
    variable.set_auto_chartostring(False)
    return variable[...]


def defined(place, old, way):
    """The variable in another file, kept in a way."""
    attributes = dict(old.__dict__)
    fill = attributes.pop("_FillValue", None)
    shape = old.shape
    if way is None:
        filters, chunking = old.filters(), old.chunking()
        storage = {} if chunking == "contiguous" else {"chunksizes": chunking}
        if filters and filters["zlib"]:
            storage |= zlib(filters["complevel"], shuffle=filters["shuffle"])
    elif math.prod(shape) < way.get("least", LEAST_COMPRESSED):
        storage = {}
    else:
        storage = {name: value for name, value in way.items() if name not in ("chunks", "least")}
        if "chunks" in way:
            storage["chunksizes"] = way["chunks"](shape)
        elif not way.get("contiguous") and old.chunking() != "contiguous":
            storage["chunksizes"] = old.chunking()
    variable = place.createVariable(old.name, old.dtype, old.dimensions, fill_value=fill, **storage)
    variable.setncatts(attributes)
    variable.set_auto_maskandscale(False)
    variable.set_auto_chartostring(False)
    return variable


def read(path: Path) -> float:
    """Seconds of processor to read all values of a file."""
    begin = time.process_time()
    with netCDF4.Dataset(path) as data:
        for group in groups(data):
            for variable in group.variables.values():
                values(variable)
    return time.process_time() - begin


def files(folder: Path, quick: bool) -> Iterator[tuple[str, Path]]:
    """The files that are copied, as the package writes them."""
    grid = 128 if quick else 512
    surface = SPECTRUM.realise(grid=grid, seed=1)
    pressures = np.geomspace(1e-3, 3e-2, 10)
    snapshots = [("reduced_pressure", each) for each in pressures[::2]]
    run = icha.simulate(surface, MATERIAL, icha.Path(reduced_pressures=pressures, snapshots=snapshots), seed=1)
    write_dataset(run, folder / "run.nc")
    yield f"run, {grid}²", folder / "run.nc"
    write_surface(folder / "surface.nc", surface, name="rough", seed=1, spectrum=SPECTRUM)
    yield f"surface, {grid}²", folder / "surface.nc"
    write_surface(folder / "large.nc", SPECTRUM.realise(grid=4 * grid, seed=1), name="rough", seed=1, spectrum=SPECTRUM)
    yield f"surface, {4 * grid}²", folder / "large.nc"
    write_campaign(seeds(run), folder / "campaign.nc")
    yield f"campaign, {RUNS} runs", folder / "campaign.nc"


def seeds(run):
    """As many runs as a campaign shall have: a run's values, each changed a little, as other seeds change them."""
    for seed in range(RUNS):
        random = np.random.default_rng(seed)
        changed = {
            name: (variable.dims, variable.values * (1 + 1e-3 * random.standard_normal(variable.shape)), variable.attrs)
            for name, variable in run.variables.items()
            if variable.dtype.kind == "f" and set(variable.dims) & {"step", "snapshot", "spot"}
            if name not in ("snapshot_target", "step_target")
        }
        changed["seed"] = ((), seed, run["seed"].attrs)
        yield RunLabels("study", "asperities", "rough", seed, 1.0, "soft"), run.assign(changed)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="smaller surfaces, to see that it runs")
    quick = parser.parse_args().quick
    ways = {"kept": None} | {
        name: way for name, way in WAYS.items() if "zstd" not in name or netCDF4.__has_zstandard_support__
    }
    with tempfile.TemporaryDirectory() as scratch:
        for title, source in files(Path(scratch), quick):
            print(f"\n| {title} | size, KiB | write, ms | read, ms |\n| --- | ---: | ---: | ---: |", flush=True)
            for name, way in ways.items():
                target = Path(scratch, "copy.nc")
                written = min(copied(source, target, way) for _ in range(REPEATS))
                seconds = min(read(target) for _ in range(REPEATS))
                size = target.stat().st_size
                print(f"| {name} | {size / 1024:.0f} | {1e3 * written:.0f} | {1e3 * seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
