"""Untrusted configurations: each is valid, or refused at once with file, key, value and what is expected."""

import os
import re

import pytest
import yaml
from demo_configuration import GOOD, REPOSITORY, measured_surface
from hypothesis import given
from hypothesis import strategies as st

from icha.configuration.errors import ConfigurationError
from icha.configuration.load import load_configuration
from icha.configuration.yaml_files import read_yaml
from icha.planning.plan import plan


def test_thousands_of_cases_are_read_and_aliases_count_as_what_they_stand_for(tmp_path):
    (tmp_path / "one.yaml").write_text("a: [" + "1, " * 20_000 + "]")
    assert len(read_yaml(tmp_path / "one.yaml")["a"]) == 20_000
    (tmp_path / "two.yaml").write_text("a: [&b {seed: 1}" + ", *b" * 2000 + "]")
    assert read_yaml(tmp_path / "two.yaml")["a"] == [{"seed": 1}] * 2001


@pytest.mark.parametrize(
    "number",
    ["9" * 5000, "0x" + "f" * 5000, "1" + ":59" * 3000, "1" + ":1" * 180 + ".5", "0b_", "0x_", "-0b_", "2026-02-30"],
)
def test_what_only_looks_like_a_number_is_text_until_it_is_checked(number, tmp_path):
    (tmp_path / "one.yaml").write_text(f"a: {number}")
    assert read_yaml(tmp_path / "one.yaml") == {"a": number}
    (tmp_path / "two.yaml").write_text(GOOD.replace("grid: 80", f"grid: {number}"))
    with pytest.raises(ConfigurationError, match=r"rough\.grid: .* is not an integer from 8 to 32768; expected "):
        load_configuration(tmp_path / "two.yaml")


@pytest.mark.parametrize("key", ["1.5", "1", "yes", "~", "2026-02-01"])
def test_keys_that_are_not_text_are_refused_by_their_line(key, tmp_path):
    (tmp_path / "one.yaml").write_text(GOOD.replace("  rough:", f"  {key}:"))
    with pytest.raises(ConfigurationError, match=r"one\.yaml, line 7: key .+ is not text; use quotes"):
        load_configuration(tmp_path / "one.yaml")


def test_pipes_and_devices_are_not_opened(tmp_path, refused):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    other = "is not a file but a device, a pipe or a socket"
    wrong = {pipe: other, "/dev/zero": other, tmp_path: "is a folder", tmp_path / "none": "no such file"}
    for path, problem in wrong.items():
        with pytest.raises(ConfigurationError, match=f"{problem}; expected a YAML file"):
            load_configuration(path)
    for path in (str(pipe), "/dev/zero"):
        for surface in (measured_surface(path=path), {"kind": "file", "height_unit": "um", "period": "1 mm"}):
            refused("surfaces.rough", surface | {"path": path}, f"surfaces.rough.path: '{path}' {other}")
        columns = {"load": {"column": "a", "unit": "1"}, "area": {"column": "b", "unit": "1"}}
        entry = {"path": path, "label": "a", "citation": "b", "study": "one"} | columns
        refused("measurements", {"m": entry}, f"measurements.m.path: '{path}' {other}")
        refused("figures", {"mine": {"study": "one", "script": path}}, f"figures.mine.script: '{path}' {other}")


STOPS = {"reduced_pressures": [1e-3 + 1e-6 * i for i in range(2000)]}
WRONG = {
    "unit of 100 kB": ({"surfaces.rough.period": "1 " + "m" * 100_000}, "is not a number with a unit; expected "),
    "far beyond decimals": ({"materials.soft.contact_modulus": f"1e{'9' * 50} MPa"}, "is not finite; expected "),
    "cases times seeds": (
        {"studies.one.cases": [{"surface": "rough", "material": "soft"}] * 100, "studies.one.seeds": "1..30000"},
        "studies: defines 6000000 runs; expected at most 100000",
    ),
    "stops of all runs": (
        {"studies.one.seeds": "1..20000", "studies.one.targets": STOPS},
        "studies: defines 80040000 targets of all runs; expected at most 5000000",
    ),
    "defaults of all studies": (
        {
            "defaults": {"studies": {"targets": STOPS}},
            "studies": {f"s{i}": {"surfaces": ["rough"]} for i in range(1000)},
        },
        "the file has more than 1000000 values, with aliases and defaults expanded; expected fewer",
    ),
    "grid": (
        {"surfaces.rough": measured_surface(grid=32768), "studies.one.seeds": [1]},
        "surfaces.rough.grid: 32768 gives a surface of 32768 x 32768 points, which needs about 25.8 GB of memory",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_values_that_would_take_too_long_or_fail_late(case, refused):
    refused("", *WRONG[case])


# What hypothesis puts in the place of values of configurations that come with ICHA.
_NUMBERS = st.one_of(st.integers(), st.floats(), st.sampled_from([0, -1, 2**31, 1e300, -1e-300, 5e-324]))
_TEXTS = st.one_of(
    st.text(max_size=20),
    st.sampled_from(["", "measured", "every_stop", "1..3", "3..1", "1e999999 MPa", "1 um", "-1 um", "nan", "..", "/"]),
    st.builds("{} {}".format, st.floats(), st.sampled_from(["m", "um", "MPa", "J/m^2", "1", "m^-1", "hour"])),
)
_SCALARS = st.one_of(st.none(), st.booleans(), _NUMBERS, _TEXTS, st.dates())
_VALUES = st.recursive(
    _SCALARS,
    lambda each: st.lists(each, max_size=4) | st.dictionaries(_TEXTS | _NUMBERS, each, max_size=4),
    max_leaves=8,
)
_SHIPPED = [
    yaml.safe_load((REPOSITORY / f"config/campaigns/{name}.yaml").read_text())
    for name in ("smoke", "hysteresis", "tabor", "validation")
]


@st.composite
def mutated(draw):
    """Change, remove or move some values of a configuration of ICHA."""
    content = yaml.safe_load(yaml.safe_dump(draw(st.sampled_from(_SHIPPED))))
    if draw(st.booleans()):
        content["defaults"] = {"surfaces": {"hurst": 0.8}, "materials": {"surface_energy": "0 J/m^2"}}
    for _ in range(draw(st.integers(1, 3))):
        inside = content
        while True:
            keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            if isinstance(inside[key], dict | list) and inside[key] and draw(st.integers(0, 4)):
                inside = inside[key]
                continue
            change = draw(st.sampled_from(["value", "gone", "twice", "new"]))
            if change == "value":
                inside[key] = draw(_VALUES)
            elif change == "gone":
                del inside[key]
            elif isinstance(inside, list):
                inside.append(inside[key] if change == "twice" else draw(_VALUES))
            else:
                inside[draw(_TEXTS)] = inside[key] if change == "twice" else draw(_VALUES)
            break
    return content


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Return the path of the configurations."""
    return tmp_path_factory.mktemp("mutated") / "campaign.yaml"


@given(content=mutated())
def test_mutated_configurations_are_right_or_refused(file, content):
    _loaded_or_refused(file, yaml.safe_dump(content, allow_unicode=True))


# What YAML takes for something else than text, or nearly.
_ODD = ["0b_", "-0x_", "1:1:1.5", f"1{':1' * 180}.5", "1.5", "._", "2026-02-30", "~", "yes", ".nan", "=", "<<", "*a"]


@given(content=st.sampled_from(_SHIPPED), data=st.data())
def test_mutated_texts_are_right_or_refused(file, content, data):
    """Change characters, keys and values of the text, remove or repeat lines."""
    text = yaml.safe_dump(content, allow_unicode=True)
    lines = text.splitlines(keepends=True)
    for _ in range(data.draw(st.integers(1, 3))):
        k = data.draw(st.integers(0, len(lines) - 1))
        at = data.draw(st.integers(0, len(lines[k]) - 1))
        odd = data.draw(st.sampled_from(_ODD))
        lines[k] = data.draw(
            st.sampled_from(
                [
                    re.sub(r"(?<=[:-] ).*", odd, lines[k]),
                    re.sub(r"[\w.]+(?=:)", odd, lines[k], count=1),
                    lines[k][:at] + data.draw(st.sampled_from(list("{}[]:-&*!|>'\"%@`#,?0\t\x00é \n"))) + lines[k][at:],
                    lines[k] * 2,
                    "\n",
                ]
            )
        )
    _loaded_or_refused(file, "".join(lines))


def _loaded_or_refused(file, text):
    file.write_text(text, encoding="utf-8")
    try:
        plan(load_configuration(file).campaign, file.parent)
    except ConfigurationError as error:
        assert str(error).startswith(str(file)) and len(str(error)) < 200_000


@pytest.mark.parametrize(
    ("before", "after", "line", "message"),
    [
        ("[0.2, 1.0]", "[0.2, 1.0", "rms_slopes", "a bracket from line {} is not closed, or a comma is missing"),
        ("    rms_slopes", "\trms_slopes", "rms_slopes", "a tab; YAML allows only spaces in front of a key"),
        ("name: demo", "name: demo: x", "name", "a second colon; put text with a colon into quotes"),
        ("name: demo", 'name: "demo', "name", "the quotes from line {} are not closed"),
    ],
)
def test_slips_in_yaml_are_explained(tmp_path, before, after, line, message):
    file = tmp_path / "campaign.yaml"
    text = yaml.safe_dump(yaml.safe_load(GOOD), sort_keys=False, default_flow_style=None)
    assert text.count(before) >= 1
    file.write_text(text.replace(before, after, 1))
    number = next(k for k, each in enumerate(file.read_text().splitlines(), 1) if line in each)
    with pytest.raises(ConfigurationError, match=re.escape(message.format(number))):
        load_configuration(file)
