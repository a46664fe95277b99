"""Texts from files and jobs have no effect on a terminal, a log or a page."""

import sys
import unicodedata

import netCDF4
import pytest
import small_campaign as small
from typer.testing import CliRunner

from icha.cli import app
from icha.cli.project import UserError, echo, reports_errors
from icha.datasets.files import write_dataset
from icha.datasets.surface_file import write_surface
from icha.report.template import template
from icha.support.formatting import printable, printable_lines

EVIL = "a\x1b[2J\x9b1m\r\b\x07\x7f\u202eb\u2028c\u200b"


def test_nothing_acts_on_a_terminal():
    assert printable(EVIL) == r"a\x1b[2J\x9b1m\r\x08\x07\x7f\u202eb\u2028c\u200b"
    assert printable("a\nb\tc") == r"a\nb\tc" and printable_lines("a\nb\tc") == "a\nb\tc"
    # By the categories of the Unicode standard, no control character remains. Joiners, and signs of Arabic, Syriac,
    # Egyptian and music, are visible and remain.
    left = printable("".join(map(chr, range(sys.maxunicode + 1))))
    kinds = {unicodedata.category(each) for each in left} - {"Cf"}
    assert not kinds & {"Cc", "Cs", "Zl", "Zp"}
    assert not [each for each in left if unicodedata.bidirectional(each) in ("LRE", "RLE", "LRO", "RLO", "PDF")]
    assert not [each for each in left if unicodedata.bidirectional(each) in ("LRI", "RLI", "FSI", "PDI")]


@pytest.mark.parametrize("text", ["", "plain", "Höhe 25 µm", "می‌خواهم", "日本語", "👩‍🔬", "a  b", "A/A0 ≤ 0.1 – yes"])
def test_what_people_write_stays(text):
    assert printable(text) == printable_lines(text) == text


def test_commands_say_nothing_else(capsys):
    echo(EVIL, fg="red")
    echo(f"two\n{EVIL}", err=True)
    with pytest.raises(Exception, match="2"):
        reports_errors(lambda: (_ for _ in ()).throw(UserError(EVIL)))()
    out, err = capsys.readouterr()
    assert r"\x1b[2J" in out and r"\x1b[2J" in err and err.startswith("two\n")
    assert not set("\x1b\x9b\r\b\x07\x7f\u202e") & set(out + err)


def test_no_text_of_a_file_begins_a_line_of_its_own(tmp_path):
    forged = f"{EVIL}\nrun.nc: run, all is well"
    run = small.run().copy()
    run.attrs |= dict.fromkeys(("title", "campaign", "study", "incomplete", "contact_model"), forged)
    run.to_netcdf(tmp_path / "run.nc")
    write_surface(tmp_path / "surface.nc", small.surface(), name="rough", seed=1)
    with netCDF4.Dataset(tmp_path / "surface.nc", "a") as file:
        file["rms_height"].long_name = file["rms_height"].units = file["rms_slope"].units = forged
    tree = small.tree()
    tree.attrs["summary"] = forged
    write_dataset(tree, tmp_path / "campaign.nc")
    told = {}
    for command, name in (("show", "run"), ("show", "surface"), ("check", "surface"), ("show", "campaign")):
        said = told[command, name] = CliRunner().invoke(app, [command, str(tmp_path / f"{name}.nc")]).output
        assert "all is well" in said, said
        assert "\nrun.nc" not in said and not set("\x1b\x9b\r\b\x07\x7f\u202e") & set(said)
    assert told["show", "run"].count("all is well") == 5 and "2 problems" in told["check", "surface"]


def test_pages_hold_no_overrides_and_no_control_characters():
    page = template("explorer.html").environment.from_string(
        "{{ title }} {{ title | symbols }} {{ n }} {{ safe | safe }}"
    )
    text = page.render(title=EVIL + "<b>", n=3, safe="<i>\u200d</i>")
    assert not set("\x1b\x9b\r\b\u202e\u2028") & set(text)
    assert text.count(r"\u202e") == 2 and "<b>" not in text and text.endswith("3 <i>\u200d</i>")
