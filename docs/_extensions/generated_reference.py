"""Sections of the reference that are generated from the package when the site is built.

The line `<!-- reference: NAME -->` of a page is replaced by the text of the function NAME.
"""

import re
import tempfile
from functools import cache
from pathlib import Path

MARK = re.compile(r"^<!-- reference: (\w+) -->$", flags=re.MULTILINE)


def configuration() -> str:
    """Tables of all configuration keys, one per section."""
    from icha.configuration.schema import key_tables

    return key_tables().replace("### ", "## ")


def commands() -> str:
    """All commands of `icha` with their arguments and options."""
    import typer

    from icha.cli import app

    group = typer.main.get_command(app)
    return "\n".join(_command(f"icha {name}", command) for name, command in group.commands.items())


def _command(name, command):
    import click

    context = click.Context(command, info_name=name)
    # Typer marks paragraphs that must not be refilled.
    text = re.sub(r"\s*\x08\s*", "\n\n", command.help or "")
    usage = " ".join(command.get_usage(context).split()[1:])
    lines = [f"## `{name}`", "", text.strip(), "", "```text", usage, "```", ""]
    rows = []
    for parameter in command.params:
        names = ", ".join(f"`{option}`" for option in (*parameter.opts, *parameter.secondary_opts))
        if isinstance(parameter, click.Argument):
            names = f"`{parameter.human_readable_name}`"
        default = parameter.default() if callable(parameter.default) else parameter.default
        if parameter.required:
            default = "required"
        elif default in (None, (), [], False, ""):
            default = "none"
        else:
            default = f"`{default}`"
        rows.append(f"| {names} | {default} | {_cell(getattr(parameter, 'help', None) or '')} |")
    if rows:
        lines += ["| argument or option | default | meaning |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def run_variables() -> str:
    """Variables of the file of a run."""
    from icha.contact.models import MODELS
    from icha.datasets.variables.run import ADHESION_MAP, CYCLE, FURTHER, INDENTER, LAYER, LOOP, RUN

    sections = {
        "All runs": RUN,
        **{f"Runs with {MODELS[name].words}": variables for name, variables in FURTHER.items() if variables},
        "Runs that unload": CYCLE,
        "Runs that end without contact": LOOP,
        "Runs on a free square": INDENTER,
        "Runs on a layer": LAYER,
        "Runs with a map of works of adhesion": ADHESION_MAP,
    }
    return "\n".join(f"### {heading}\n\n{_table(_rows(variables))}" for heading, variables in sections.items())


def campaign_variables() -> str:
    """Variables of a campaign dataset besides those of its runs, and the dimensions of all."""
    from icha.datasets.labels import LABELS
    from icha.datasets.variables.run import CYCLE, LOOP, OF_SOME, RUN

    study = _small_campaign()["study"].to_dataset()
    of_runs = RUN | CYCLE | LOOP | OF_SOME
    own = {name: variable for name, variable in study.variables.items() if name not in of_runs}
    shared = {
        name: ", ".join(dim for dim in study[name].dims if dim not in of_runs[name].dims) or "none"
        for name in of_runs
        if name in study and name not in study.dims and not {"spot", "event"} & set(study[name].dims)
    }
    everything = {", ".join(LABELS)}
    fewer = {}
    for name, along in shared.items():
        if along not in everything:
            fewer.setdefault(along, []).append(f"`{name}`")
    lines = [f"- {along}: {', '.join(names)}" for along, names in fewer.items()]
    return _table(_rows_of(own)) + "\nVariables with only some of these dimensions:\n\n" + "\n".join(lines) + "\n"


def comparison_variables() -> str:
    """Variables of the comparison of the runs of a study."""
    from icha.analysis.common_loads import compare_runs

    return _table(_rows_of(compare_runs(_small_campaign()["study"].to_dataset()).variables))


def surface_variables() -> str:
    """Variables of the file of a surface."""
    from icha.datasets.files import read_dataset
    from icha.datasets.surface_file import write_surface

    spectrum = _small_spectrum()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "surface.nc")
        write_surface(path, spectrum.realise(grid=32, seed=1), name="rough", seed=1, spectrum=spectrum)
        return _table(_rows_of(read_dataset(path).variables))


def model_error_variables() -> str:
    """Variables of the comparison with boundary elements."""
    from icha.analysis.model_error import AXES
    from icha.datasets.variables.model_error import MODEL_ERROR

    return _table(_rows({name: own._replace(dims=(*AXES, *own.dims)) for name, own in MODEL_ERROR.items()}))


def answer_variables() -> str:
    """Variables of the answers of a study."""
    from icha.datasets.variables.answers import ANSWERS

    return _table(_rows(ANSWERS))


def theory_variables() -> str:
    """Variables of the theories of a surface."""
    import icha
    from icha.references.theories import reference_dataset
    from icha.surfaces.moments import spectral_moments

    spectrum = _small_spectrum()
    material = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=2e-9)
    theories = reference_dataset(spectrum, spectral_moments(spectrum.realise(32, 1)), {(1.0, "soft"): material})
    return _table(_rows_of(theories.variables))


def _small_spectrum():
    import icha

    return icha.SelfAffineSpectrum(period=100e-6, rolloff_wavelength=40e-6, short_wavelength=100e-6 / 7, hurst=0.8)


@cache
def _small_campaign():
    """Return a campaign of one run with unloading on a surface of a few summits."""
    import icha
    from icha.datasets.campaign_file import campaign_tree

    material = icha.Material(contact_modulus=25e6, surface_energy=0.05, interaction_range=2.071e-9)
    path = icha.Path(reduced_pressures=[5e-4, 1e-3], unload=True, max_step=0.5)
    run = icha.simulate(_small_spectrum().realise(32, 1), material, path, seed=1)
    return campaign_tree([(("study", "asperities", "rough", 1, 1.0, "soft"), run)])


def _rows(variables):
    return ((name, own.dims, own.units, own.long_name) for name, own in variables.items())


def _rows_of(variables):
    return ((n, v.dims, v.attrs.get("units", ""), v.attrs.get("long_name", "")) for n, v in variables.items())


def _table(rows):
    lines = ["| variable | along | unit | meaning |", "|---|---|---|---|"]
    for name, dims, units, text in rows:
        lines.append(f"| `{name}` | {', '.join(dims)} | {units} | {_cell(text)} |")
    return "\n".join([*lines, ""])


def _cell(text):
    """Escape text for a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*")


SECTIONS = {
    section.__name__: section
    for section in (
        configuration,
        commands,
        run_variables,
        campaign_variables,
        comparison_variables,
        surface_variables,
        model_error_variables,
        answer_variables,
        theory_variables,
    )
}


def insert_sections(app, docname, source):
    """Replace the marks of a page by the generated sections."""
    source[0] = MARK.sub(lambda match: SECTIONS[match[1]](), source[0])


def pages_to_read(app, env, added, changed, removed):
    """Return the pages with generated sections, because the package may have changed."""
    return [name for name in env.found_docs if MARK.search(Path(env.doc2path(name)).read_text(encoding="utf-8"))]


ENTRY = re.compile(r"^(?P<indent>\s*)(?P<names>[*\w]+(?:, [*\w]+)*) : (?P<text>.+)$")


# Placeholders for the text of "Returns" and for a colon in the first line of an attribute: napoleon would take both for
# types.
RETURNED, COLON = "RETURNED", "\ue000"


def plain_docstring(app, what, name, obj, options, lines):
    """Treat the text of `name : text` as a description, not as a type, and escape bars and asterisks."""
    section, new, returned = "", [], []
    for number, line in enumerate(lines):
        if number + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[number + 1].strip()):
            section = line.strip()
            new.append(line)
            continue
        match = ENTRY.match(line) if section in ("Parameters", "Attributes") else None
        if match:
            new += [f"{match['indent']}{match['names']}", f"{match['indent']}    {match['text']}"]
        elif section == "Returns" and line.strip() and not re.fullmatch(r"-{3,}", line.strip()):
            new += [] if returned else [RETURNED]
            returned.append(line.strip())
        else:
            new.append(line)
    app.env.temp_data["returned"] = " ".join(returned)
    if what in ("attribute", "property") and new:
        new[0] = new[0].replace(":", COLON)
    lines[:] = [_literal(line) for line in new]


def restore_returned_text(app, what, name, obj, options, lines):
    """Replace the placeholders by their text."""
    text = _literal(app.env.temp_data.get("returned", ""))
    lines[:] = [re.sub(rf"\*{RETURNED}\*", lambda match: text, line).replace(COLON, ":") for line in lines]


def _literal(line):
    """Escape bars and asterisks outside of code."""
    pieces = line.split("`")
    return "`".join(re.sub(r"([|*])", r"\\\1", piece) if n % 2 == 0 else piece for n, piece in enumerate(pieces))


def setup(app):
    """Connect to Sphinx."""
    app.connect("source-read", insert_sections)
    app.connect("env-get-outdated", pages_to_read)
    # Before napoleon, which turns sections into fields.
    app.connect("autodoc-process-docstring", plain_docstring, priority=400)
    app.connect("autodoc-process-docstring", restore_returned_text, priority=600)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
