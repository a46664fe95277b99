"""Put together the deposit: copies of the results, a page that says what they are, and checksums."""

import hashlib
import shutil
from pathlib import Path

from job import logged

README = """# {title}

{summary}

{authors}Licence of the data: {license}. Made with ICHA (adhesive rough contact by interacting and coalescing
asperities). All quantities are in SI units; every variable names its unit.

| path | content |
|---|---|
| `config.used.yaml` | the configuration: everything that was asked for |
| `dataset/` | the campaign dataset, netCDF-4, one group per study: `xarray.open_datatree` |
| `aggregated/` | the runs of every study compared at common loads, and with boundary elements where there are any |
| `runs/` | the same runs, one file each |
| `surfaces/` | the topographies, at rms slope 1 |
| `references/` | theory curves, published points and boundary-element solutions for these surfaces |
| `figures/`, `report.html` | figures, and the report with tables and checks |
| `checks.json`, `verdict.txt` | checks of the results, and that all passed |
| `SHA256SUMS` | checksums of all files: `sha256sum -c SHA256SUMS` |
"""


def publish(files, checksums, *, title, summary, license, authors):
    """Copy `files` to the folder of `checksums`, which lies beside them, and write the checksums last."""
    folder = Path(checksums).parent
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    for file in files:
        copy = part / Path(file).relative_to(folder.parent)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    names = ", ".join(" ".join([author["name"], author.get("orcid", "")]).strip() for author in authors)
    text = README.format(
        title=title, summary=summary, license=license, authors=f"Authors: {names}.\n\n" if names else ""
    )
    (part / "README.md").write_text(text, encoding="utf-8")
    sums = [f"{_sha256(path)}  {path.relative_to(part)}\n" for path in sorted(part.rglob("*")) if path.is_file()]
    (part / Path(checksums).name).write_text("".join(sums), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    part.rename(folder)


def _sha256(path):
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


if "snakemake" in globals():
    with logged(snakemake.log[0]):
        publish(
            sorted(snakemake.input),
            snakemake.output[0],
            **{key: snakemake.params[key] for key in ("title", "summary", "license", "authors")},
        )
