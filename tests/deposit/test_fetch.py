"""`icha.fetch_deposit`: the campaign dataset of a deposit from a path, a web address or a DOI, if it is whole."""

import functools
import hashlib
import http.server
import threading

import netCDF4
import pytest
import small_campaign as small

import icha
from icha.datasets.files import write_dataset


@pytest.fixture
def deposit(pack, tmp_path):
    """The folder of a deposit with a campaign dataset; its zip is beside it."""
    tree = small.campaign_tree(list(small.runs()), attrs={"campaign": "small"})
    write_dataset(tree, tmp_path / "small.nc")
    return pack({"dataset/small.nc": (tmp_path / "small.nc").read_bytes(), "README.md": "# Small\n"}, "small-1.0")


@pytest.fixture
def server(tmp_path):
    """The address of a server of the files in the temporary folder, and the paths that were requested."""
    requested = []

    class Handler(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            requested.append(self.path)

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=str(tmp_path))) as each:
        threading.Thread(target=each.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield f"http://127.0.0.1:{each.server_port}", requested
        each.shutdown()


def assert_is_small(tree):
    (study, *_) = tree.children
    assert float(tree[study]["contact_area_fraction"].max()) > 0 and tree.attrs["campaign"] == "small"


def test_a_path_gives_the_dataset_and_an_address_is_downloaded_once(deposit, server, tmp_path):
    for path in (deposit, str(deposit), f"{deposit}.zip"):
        assert_is_small(icha.fetch_deposit(path))
    with pytest.raises(FileNotFoundError, match="expected a DOI, a web address, or a path"):
        icha.fetch_deposit(deposit / "none.zip")
    address, requested = server
    for _ in range(2):
        assert_is_small(icha.fetch_deposit(f"{address}/small-1.0.zip", cache=tmp_path / "cache"))
    assert requested == ["/small-1.0.zip"]


@pytest.mark.parametrize("source", ["10.5281/zenodo.77", "doi:10.5281/zenodo.77", "https://doi.org/10.5281/zenodo.77"])
def test_a_doi_gives_the_zip_of_the_record(source, deposit, server, tmp_path, monkeypatch):
    md5 = hashlib.md5(deposit.with_name("small-1.0.zip").read_bytes()).hexdigest()
    files = {"small-1.0.zip": f"md5:{md5}", "README.md": "md5:0"}

    def registry(record):
        assert record.base_url == "doi:10.5281/zenodo.77/"
        record.base_url, record.registry = f"{server[0]}/", files

    monkeypatch.setattr("pooch.Pooch.load_registry_from_doi", registry)
    assert_is_small(icha.fetch_deposit(source, cache=tmp_path / "cache"))
    files["small-1.0.zip"] = "md5:" + 32 * "0"
    with pytest.raises(ValueError, match="hash"):
        icha.fetch_deposit(source, cache=tmp_path / "other")
    files["more.zip"] = "md5:0"
    with pytest.raises(ValueError, match="has 2 zips; expected a record with one zip"):
        icha.fetch_deposit(source, cache=tmp_path / "cache")


def test_damaged_deposits_and_other_archives_are_refused(deposit, pack):
    with netCDF4.Dataset(deposit / "dataset/small.nc", "a") as file:
        file.title = "Changed"
    with pytest.raises(ValueError, match=r"the deposit is damaged: dataset/small\.nc: was changed"):
        icha.fetch_deposit(deposit)
    with pytest.raises(ValueError, match="has 0 files dataset"):
        icha.fetch_deposit(pack({"README.md": "# Other\n"}, "other"))
