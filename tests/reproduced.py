"""`icha reproduce` as tests call it, and the lock file of a deposit."""

from importlib.metadata import version

from typer.testing import CliRunner

from icha.cli import app


def lock(numpy=None):
    """A lock file with numpy alone, in the version that is installed or in another one."""
    numpy = numpy or version("numpy")
    return f'[[package]]\nname = "numpy"\nversion = "{numpy}"\nsource = {{ registry = "https://pypi.org/simple" }}\n'


def caller(monkeypatch, capfd, temporary):
    """A function that calls the command, and returns its exit status and all that it and its programs said.

    Temporary folders are made in `temporary`; nothing may stay of what is refused, and nothing act on the terminal.
    """
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))

    def call(*arguments):
        done = CliRunner().invoke(app, ["reproduce", *map(str, arguments)])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        out, err = capfd.readouterr()
        if done.exit_code == 2:
            assert list(temporary.iterdir()) == []
        said = done.output + out + err
        assert not set("\x1b\u202e") & set(said)
        return done.exit_code, said

    return call
