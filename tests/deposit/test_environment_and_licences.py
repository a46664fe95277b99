"""What a deposit promises and names: the locked environment, licences, creators."""

import importlib.metadata
import importlib.util
import re

import pytest
from publications import ALL, LEAST, ORCID

from icha.deposit.attributes import discovery_attributes
from icha.deposit.environment import differences, refuse_other_environment
from icha.deposit.licences import known_licence, licence_page


def test_another_environment_than_the_locked_one_is_refused(tmp_path):
    version = importlib.metadata.version("numpy")

    def lock(*packages):
        text = "\n".join(
            f'[[package]]\nname = "{name}"\nversion = "{number}"\nsource = {{ {source} }}\n'
            for name, number, source in packages
        )
        (tmp_path / "uv.lock").write_text(f"version = 1\n{text}")
        return (tmp_path / "uv.lock").read_text()

    index = 'registry = "https://pypi.org/simple"'
    own = ("icha", "99.0", 'editable = "."')
    # Locked for another Python, not installed, and the project itself.
    assert differences(lock(own, ("numpy", "0.1", index), ("numpy", version, index), ("no-such", "1", index))) == []
    wrong = differences(lock(own, ("NumPy", "0.1", index)))
    assert wrong == [f"  numpy: {version} is installed, 0.1 is locked"]
    with pytest.raises(ValueError, match=r"make environment(.|\n)*icha: imported from(.|\n)*numpy: "):
        refuse_other_environment(tmp_path)


def test_licences_are_those_of_spdx():
    for identifier, words in {
        "CC-BY-4.0": "Section 3 – License Conditions",
        "CC-BY-SA-4.0": "Section 4 – Sui Generis Database Rights",
        "CC0-1.0": "Statement of Purpose",
        "ODbL-1.0": "Database",
    }.items():
        licence = known_licence(identifier)
        assert licence.identifier == identifier and words in licence.text
        page = licence_page(licence, source="source")
        assert licence.name in page and licence.address in page and page.endswith(licence.text)
    other = known_licence("PDDL-1.0")
    assert other.text == "" and other.address == "https://spdx.org/licenses/PDDL-1.0.html"
    assert "PDDL-1.0" in licence_page(other, source="source")
    for wrong in ("CC-BY", "my own", "MIT OR CC0-1.0", "LicenseRef-mine", "CC-BY-4.0+", ""):
        with pytest.raises(ValueError, match="is no licence that SPDX knows; allowed: one identifier"):
            known_licence(wrong)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("cc-by-4.0", "is not written as SPDX writes it; allowed: 'CC-BY-4.0'"),
        (" CC0-1.0", "is not written as SPDX writes it; allowed: 'CC0-1.0'"),
        ("GPL-3.0", "is an identifier that SPDX has deprecated; allowed: 'GPL-3.0-only', 'GPL-3.0-or-later'"),
        ("LGPL-2.1+", "is an identifier that SPDX has deprecated; allowed: 'LGPL-2.1-or-later'"),
        ("eCos-2.0", "has deprecated; allowed: a current one of https://spdx.org/licenses"),
    ],
)
def test_licences_are_written_as_spdx_writes_them(wrong, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        known_licence(wrong)


def test_creators_of_a_dataset_keep_their_places():
    found = discovery_attributes(ALL)
    assert found["creator_name"] == "Josiah Carberry; California Digital Library; Zoë Öre Ünal"
    assert found["creator_type"] == "person; institution; person"
    assert found["creator_url"] == f"https://orcid.org/{ORCID}; https://ror.org/03yrm5c26; "
    assert found["creator_institution"] == "California Digital Library; ; Nowhere <Institute> & Sons"
    assert found["keywords"] == "adhesion, rough surfaces, soft"
    assert set(discovery_attributes(LEAST)) == {"creator_name", "creator_type", "product_version"}
