"""Variables of theories of rough contact for one surface, and of published results."""

from icha.datasets.variables.terms import TERMS, read_tables

THEORIES = read_tables(
    "theories.txt",
    TERMS,
    area=TERMS["contact_area_fraction"].long_name,
    pressure=TERMS["reduced_pressure"].long_name,
    separation=TERMS["reduced_separation"].long_name,
)[""]
