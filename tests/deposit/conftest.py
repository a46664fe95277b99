"""Deposits made by hand."""

import zipfile

import pytest
from outside_validators import sealed


@pytest.fixture
def pack(tmp_path):
    """Write a deposit with files of these contents, whole, to a folder and a zip; return the folder."""

    def packed(files, name="tiny", listed=True):
        folder = tmp_path / name
        for path, content in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content if isinstance(content, bytes) else content.encode())
        if listed:
            sealed(folder)
        with zipfile.ZipFile(tmp_path / f"{name}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(folder.rglob("*")):
                if path.is_file():
                    archive.write(path, f"{name}/{path.relative_to(folder)}")
        return folder

    return packed
