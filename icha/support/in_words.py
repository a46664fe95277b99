"""Numbers, bytes, times and lengths as people say them."""

import math

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: ""}


def counted(number: int, thing: str) -> str:
    """`1 run`, `3 runs`."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def share(count: int, total: int) -> str:
    """A part of a whole as a percentage to two digits: `31 %`, `0.024 %`."""
    return f"{_digits(100 * count / total, 2)} %"


def size(count: float) -> str:
    """Bytes to three digits: `15 B`, `70.2 kB`, `1.5 GB`."""
    for factor, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= factor:
            return f"{_digits(count / factor, 3)} {unit}"
    return f"{count:.0f} B"


def duration(seconds: float) -> str:
    """Seconds to two digits: `4.2 s`, `3.3 min`, `14 h`, `5.2 days`."""
    for factor, unit, least in ((86400, "days", 100 * 3600), (3600, "h", 3600), (60, "min", 60)):
        if seconds >= least:
            return f"{_digits(seconds / factor, 2)} {unit}"
    return f"{_digits(seconds, 2)} s"


def _digits(value: float, digits: int) -> str:
    """A number to so many digits, without a power of ten where it has more before its point."""
    return f"{value:.0f}" if value >= 10.0**digits - 0.5 else f"{value:.{digits}g}"


def length(metres: float) -> str:
    """Metres with a unit as configurations write it, such as `2.5 um`."""
    power = 3 * math.floor(math.log10(abs(metres)) / 3 + 1e-9) if metres else 0
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return f"{metres * 10.0**-power:.6g} {_PREFIXES[power]}m"
