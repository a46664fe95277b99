"""Global attributes by which a published dataset names its makers."""

from icha.configuration.publication import Funding, Publication


def discovery_attributes(publication: Publication) -> dict[str, str]:
    """Global attributes of the Attribute Convention for Data Discovery (ACDD 1.3) that a publication gives a dataset.

    Of several creators the values are lists with semicolons, for names hold commas, in the same order; where one has no
    value it is empty, and where none has, the attribute is left out.
    """
    authors = publication.authors
    found = {
        "creator_name": [author.full_name for author in authors],
        "creator_type": ["person" if author.is_person else "institution" for author in authors],
        "creator_url": [author.orcid_address or author.ror or "" for author in authors],
        "creator_institution": [author.affiliation or "" for author in authors],
        "keywords": [", ".join(publication.keywords)],
        "product_version": [publication.version or ""],
        "acknowledgement": [acknowledgement(each) for each in publication.funding],
        "metadata_link": [f"https://doi.org/{publication.doi}" if publication.doi else ""],
    }
    return {name: "; ".join(values) for name, values in found.items() if any(values)}


def acknowledgement(funding: Funding) -> str:
    """Who paid, in words."""
    number = f"award {funding.award_number}" if funding.award_number else ""
    award = ": ".join(filter(None, (number, funding.award_title)))
    return f"Funded by {funding.funder}{f' ({award})' if award else ''}"
