"""Made-up publications: one with the least that is needed, and one with all that there can be.

The person with an ORCID is the one whom its documentation made up; the organisation is the example of ROR's.
"""

from icha.configuration.publication import Author, Funding, KnownFailure, Publication, RelatedIdentifier

ORCID = "0000-0002-1825-0097"
COMMIT = "0123456789abcdef0123456789abcdef01234567"

LEAST = Publication(
    version="1.0",
    date="2026-01-31",
    authors=[Author(name="ICHA developers")],
    title="Area against load",
    summary="Loading of one surface.",
    license="CC-BY-4.0",
)
ALL = Publication(
    version="1.0.0-rc.1",
    date="2026-01-31",
    authors=[
        Author(
            family_names="Carberry",
            given_names="Josiah",
            orcid=ORCID,
            affiliation="California Digital Library",
            ror="https://ror.org/03yrm5c26",
        ),
        Author(name="California Digital Library", ror="https://ror.org/03yrm5c26"),
        Author(family_names="Öre Ünal", given_names="Zoë", affiliation="Nowhere <Institute> & Sons"),
    ],
    title="Area against load: surfaces & materials",
    summary="Loading of one surface,\nat five slopes <1.\n\nAnd unloading.",
    license="CC0-1.0",
    keywords=["adhesion", "rough surfaces, soft"],
    funding=[
        Funding(
            funder="European Commission",
            funder_id="10.13039/501100000780",
            award_number="284382",
            award_title="Title of the grant",
            award_url="https://cordis.europa.eu/project/id/284382",
        ),
        Funding(funder="California Digital Library", funder_id="https://ror.org/03yrm5c26", award_number="7 b"),
        Funding(funder="Nobody & Co"),
    ],
    related_identifiers=[
        RelatedIdentifier(identifier="10.1007/s11249-017-0900-2", relation="IsSupplementTo", resource="JournalArticle"),
        RelatedIdentifier(identifier="arXiv:1606.03166", relation="Cites", resource="Preprint"),
        RelatedIdentifier(identifier="10.5281/zenodo.5171937", relation="IsDerivedFrom", resource="Dataset"),
        RelatedIdentifier(identifier="https://snakemake.github.io", relation="Requires", resource="Software"),
        RelatedIdentifier(identifier="https://example.org/page", relation="IsDocumentedBy"),
    ],
    doi="10.5281/zenodo.1234567",
    communities=["contact-mechanics"],
    known_failures=[KnownFailure(run="load/flat/seed1/slope1/soft", reason="Area < 0.1 %.")],
)
PUBLICATIONS = {"least": LEAST, "all": ALL}
