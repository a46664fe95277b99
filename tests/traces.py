"""Search of files for traces of a machine or a person: words, and times of day.

A plain search of the bytes finds no text that is compressed in a PDF or a netCDF file. Pictures in pages are those of
the figures, and archives have the files of their folder.
"""

import re
import zlib
from pathlib import Path

import netCDF4
import numpy as np

_PDF_STREAM = re.compile(rb"stream\r?\n(.*?)endstream", re.DOTALL)
# The date of publication is no trace, a time of day is.
TIMES = {
    "ISO 8601": re.compile(rb"\b(19|20)\d\d-[01]\d-[0-3]\d[T ][0-2]\d:[0-5]\d"),
    "PDF": re.compile(rb"D:(19|20)\d{10}"),
    "asctime": re.compile(rb"\b(Mon|Tue|Wed|Thu|Fri|Sat|Sun),? +(\d+ )?[A-Z][a-z]{2} +\d+ (\d{4} )?\d\d:\d\d:\d\d"),
    "netCDF or PNG": re.compile(rb"\b(19|20)\d\d:[01]\d:[0-3]\d [0-2]\d:[0-5]\d"),
    "chunk of a PNG": re.compile(rb"^\x89PNG.*tIME", re.DOTALL),
}


def written_in(path):
    """Yield the bytes of a file and of the texts that it contains, each with its place."""
    content = Path(path).read_bytes()
    yield str(path), content
    if content.startswith(b"%PDF"):
        for number, stream in enumerate(_PDF_STREAM.findall(content)):
            try:
                yield f"{path}, stream {number}", zlib.decompressobj().decompress(stream)
            except zlib.error:
                yield f"{path}, stream {number}", stream
    elif content.startswith(b"\x89HDF"):
        with netCDF4.Dataset("in memory", memory=content) as file:
            yield f"{path}, as netCDF", _netcdf_text(file).encode()


def _netcdf_text(group):
    lines = [f"{name} {group.getncattr(name)}" for name in group.ncattrs()]
    for variable in group.variables.values():
        lines += [f"{variable.name} {name} {variable.getncattr(name)}" for name in variable.ncattrs()]
        if variable.dtype == np.dtype("S1"):
            variable.set_auto_chartostring(False)
            lines.append(np.ma.filled(variable[...], b" ").tobytes().decode("utf-8", "replace"))
        elif variable.dtype is str:
            lines += np.ravel(variable[...]).astype(str).tolist()
    for inner in group.groups.values():
        lines.append(_netcdf_text(inner))
    return "\n".join(lines)


def traces(files, words, now=None):
    """Return the places of words (bytes), times of day, and seconds since 1970 in the interval `now`."""
    found = []
    for path in files:
        for where, content in written_in(path):
            found += [f"{word!r} in {where}" for word in words if word in content]
            found += [f"time ({kind}) in {where}" for kind, pattern in TIMES.items() if pattern.search(content)]
            if now is not None:
                seconds = re.findall(rb"(?<![\d.])(1\d{9})(?!\d)", content)
                found += [f"time {each!r} in {where}" for each in seconds if now[0] <= int(each) <= now[1]]
    return found
