"""Numbers in a configuration mean what they look like."""

from datetime import date

import pytest

from icha.configuration.yaml_files import dumped, read_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("064", 64),
        ("[010, 0_20, -07]", [10, 20, -7]),
        ("0", 0),
        ("0x10", 16),
        ("1_000", 1000),
        ("1:30", "1:30"),
        ("1:30.5", "1:30.5"),
        ("2001-02-03", date(2001, 2, 3)),
    ],
)
def test_leading_zeros_are_no_octal_numbers_and_colons_no_base_of_60(tmp_path, text, value):
    (tmp_path / "a.yaml").write_text(f"grid: {text}\n")
    content = read_yaml(tmp_path / "a.yaml")
    assert content == {"grid": value}
    (tmp_path / "b.yaml").write_text(dumped(content, "a"))
    assert read_yaml(tmp_path / "b.yaml") == content
