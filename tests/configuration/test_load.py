"""Files of configurations: invalid files and values, overrides, all problems at once; section `publication`."""

import datetime
import re
from datetime import date
from pathlib import Path

import pytest
import yaml
from demo_configuration import CARBERRY, GOOD, ORCID, REPOSITORY, measured_surface

from icha.configuration.errors import MOST_PROBLEMS, ConfigurationError
from icha.configuration.load import load_configuration
from icha.configuration.yaml_files import dump_yaml, read_yaml


@pytest.mark.parametrize(
    ("changes", "count", "last"),
    [
        ({"name": "A B", "surfaces.rough.hurst": 2, "materials.soft.surface_energy": "1 m", "extra": 1}, 4, ""),
        ({f"key{i}": 1 for i in range(2000)}, MOST_PROBLEMS + 1, "there are more problems; correct these first"),
        ({"studies.one.surfaces": [f"none{i}" for i in range(1000)]}, MOST_PROBLEMS + 1, "correct these first"),
        ({"\x1b[2Jx": 1}, 1, ""),
    ],
    ids=range(4),
)
def test_all_problems_are_reported_at_once_without_control_characters(changes, count, last, load):
    with pytest.raises(ConfigurationError) as error:
        load(changes)
    lines = str(error.value).splitlines()
    assert len(lines) == count and lines[-1].endswith(last)
    assert "\x1b" not in str(error.value) and ("\x1b[2Jx" not in changes or "\\x1b[2Jx: unknown key" in lines[0])


def test_messages_name_the_line_and_the_value_as_written(tmp_path):
    file = tmp_path / "campaign.yaml"
    file.write_text(GOOD + "\ndefaults:\n  materials:\n    surface_energy: 1 kJ/m^2\n")

    def line_of(text):
        return 1 + next(k for k, line in enumerate(file.read_text().splitlines()) if text in line)

    overrides = {"materials": {"hard": {"contact_modulus": "25 mPa", "interaction_range": "2 nm"}}}
    overrides |= {"studies": {"one": {"targets": {"reduced_pressures": None, "pressures": ["10 GPa"]}}}}
    with pytest.raises(ConfigurationError) as error:
        load_configuration(file, overrides)
    assert f"{file}, line {line_of('kJ')}: defaults.materials.surface_energy: '1 kJ/m^2' is unusual" in str(error.value)
    assert f"{file} with --config: materials.hard.contact_modulus: '25 mPa' is unusual" in str(error.value)
    file.write_text(GOOD.replace("hurst: 0.8", "hurts: 0.8"))
    with pytest.raises(ConfigurationError) as error:
        load_configuration(file)
    wrong, missing = str(error.value).splitlines()
    lines = {re.match(rf"{file}, line (\d+): surfaces", each)[1] for each in (wrong, missing)}
    assert lines == {str(line_of("hurts")), str(line_of("rough:"))}


def test_overrides_are_part_of_the_configuration_as_used(load, tmp_path):
    configuration = load(overrides={"surfaces": {"rough": {"hurst": 0.5}}})
    again = tmp_path / "used.yaml"
    again.write_text(configuration.text)
    assert load_configuration(again) == configuration


ALIASES = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 20))
MERGED = "a0: &a0 {k: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}\n" for i in range(1, 20))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"m:\n  x: {k: 1, k: 2}\n", "line 2: key 'k' is given twice"),
        (b"\xff\xfea\x00", "line 1: is not UTF-8; expected a YAML file saved in UTF-8"),
        ("a: 1\ntitle: Gerät\n".encode("latin-1"), "line 2: is not UTF-8"),
        (b"a: 1\nb: \x07\n", "line 2: control character 0x07; expected a YAML mapping"),
        (b"a: !!python/object:os.system {}\n", "expected a YAML mapping"),
        # Texts that would never end.
        (ALIASES.encode(), "the file has more than 1000000 values, with aliases and defaults expanded; expected "),
        (MERGED.encode(), "the key <<; write values that several entries share.*; expected "),
        (b"studies: {one: {vary: {hurst: &a [*a]}}}", "more than 50 nested sections or lists; expected "),
        (b"a: " + b"{a: " * 5000, "more than 50 nested sections or lists; expected "),
        (b"a: " + b"x" * 10**6, "is longer than 1 MB; expected "),
    ],
    ids=range(11),
)
def test_files_that_are_not_configurations(content, message, tmp_path):
    file = tmp_path / "campaign.yaml"
    file.write_bytes(content)
    with pytest.raises(ConfigurationError, match=message) as error:
        load_configuration(file)
    assert str(error.value).startswith(str(file))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("064", 64),
        ("[010, 0_20, -07]", [10, 20, -7]),
        ("0", 0),
        ("1_000", 1000),
        ("1:30", "1:30"),
        ("2001-02-03", date(2001, 2, 3)),
    ],
)
def test_leading_zeros_are_no_octal_numbers_and_colons_no_base_of_60(tmp_path, text, value):
    (tmp_path / "a.yaml").write_text(f"grid: {text}\n")
    content = read_yaml(tmp_path / "a.yaml")
    assert content == {"grid": value}
    (tmp_path / "b.yaml").write_text(dump_yaml(content, "a"))
    assert read_yaml(tmp_path / "b.yaml") == content


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"studies.one.materials": ["hard"]}, r"materials\[0\]: 'hard' is not defined"),
        ({"studies.one.unload": "perhaps"}, r"one\.unload: 'perhaps'"),
        ({"figures": {"fig2_area_and_gap": {"study": "two"}}}, r"fig2_area_and_gap\.study: 'two' is not defined"),
    ],
)
def test_problems_of_the_text_are_reported_before_a_scan_is_read(changes, message, load, monkeypatch):
    monkeypatch.setattr("icha.configuration.load.inspect_topographies", lambda campaign: pytest.fail("was read"))
    measured = {"surfaces.rough": measured_surface(), "studies.one.rms_slopes": "measured"}
    with pytest.raises(ConfigurationError, match=message):
        load(measured | changes)


def test_slopes_of_scans_are_compared_once_they_are_known(load):
    measured = {"surfaces.rough": measured_surface(), "studies.one.rms_slopes": "measured"}
    slope = load(measured).campaign.contacts("one")[0].rms_slope
    assert load({**measured, "figures": {"fig4_contact_map": {"study": "one", "rms_slope": slope}}})
    targets = {"reduced_pressures": [0.01]}
    truth = {"surfaces": ["rough"], "materials": ["soft"], "models": ["boundary_elements"], "targets": targets}
    beside = {"figures": {"fig5_multi_slope": {"study": "one", "boundary_elements": "truth"}}, **measured}
    assert load({**beside, "studies.truth": truth | {"rms_slopes": [slope]}})
    with pytest.raises(ConfigurationError, match="'truth' has no run to compare"):
        load({**beside, "studies.truth": truth | {"rms_slopes": [0.9 * slope]}})
    failures = [{"run": f"one/rough/seed0/slope{slope:g}/soft", "reason": "why"}]
    assert load({**measured, "publication": {"known_failures": failures}})
    with pytest.raises(ConfigurationError, match=r"rms_slope: 0.5 is not in study 'one'"):
        load({**measured, "figures": {"fig4_contact_map": {"study": "one", "rms_slope": 0.5}}})


_TEXT = (Path(__file__).parent / "refusals.yaml").read_text(encoding="utf-8")
CASES = yaml.safe_load(_TEXT.replace("SCAN", str(REPOSITORY / "config/topographies/synthetic_scan.txt")))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["message"].replace(" ", "_")[:70])
def test_wrong_configurations_are_refused(case, refused):
    refused("", case["changes"], case["message"])


@pytest.mark.parametrize("ror", ["03yrm5c26", "05gq02987", "00k4n6c32", "01bj3aw27", "02mhbdp94"])
def test_identifiers_of_real_institutions_have_their_check_digits(ror, load):
    written = (ror, f"http://ror.org/{ror}", f"https://ror.org/{ror.upper()}")
    authors = [{"name": str(number), "ror": each} for number, each in enumerate(written)]
    funding = [{"funder": str(number), "funder_id": each, "award_number": each} for number, each in enumerate(written)]
    publication = load({"publication": {"authors": authors, "funding": funding}}).campaign.publication
    found = {each.ror for each in publication.authors} | {each.funder_id for each in publication.funding}
    assert found == {f"https://ror.org/{ror}"}


def test_what_differs_may_stand_side_by_side(load):
    others = [{"funder": "A"}, {"funder": "A", "award_number": "1"}, {"funder": "A", "award_number": "2"}]
    paper = {"identifier": "10.1000/abc"}
    publication = {
        # Two of one name.
        "authors": [CARBERRY | {"orcid": ORCID}, CARBERRY | {"orcid": "0000-0001-5109-3700"}, {"name": "Carberry"}],
        "funding": [*others, {"funder": "B", "funder_id": "https://doi.org/10.13039/501100000780"}],
        "related_identifiers": [paper | {"relation": "Cites"}, paper | {"relation": "IsSupplementTo"}],
        "summary": "One\n\ntwo",
    }
    found = load({"publication": publication}).campaign.publication
    assert len(found.authors) == 3 and len(found.related_identifiers) == 2
    assert found.funding[-1].funder_id == "10.13039/501100000780"


def test_days_of_the_command_line(load):
    day = datetime.date(2026, 1, 31)
    assert load(overrides={"publication": {"date": day}}).campaign.publication.date == "2026-01-31"
    with pytest.raises(ConfigurationError, match=r"publication\.date: .* is not valid; expected "):
        load(overrides={"publication": {"date": datetime.datetime(2026, 1, 31, 12)}})
