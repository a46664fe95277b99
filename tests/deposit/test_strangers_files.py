"""What a stranger may do with names, kinds of files and sizes in a deposit is said, and nothing of it is done."""

import hashlib
import io
import os
import stat
import struct
import zipfile
import zlib
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from icha.cli import app
from icha.deposit.deposit_files import read_file, verify_deposit
from icha.deposit.strangers_files import LIMITS, NO_LIMITS, flaw_of_name, looked_through, unpack
from icha.support.in_words import is_printable

CONTENT = b"read"
SUM = hashlib.sha256(CONTENT).hexdigest()


def packed(path, *names, modes=(), method=zipfile.ZIP_STORED):
    """A zip with these entries, each of the same content, and a list that names those of its top folder."""
    with zipfile.ZipFile(path, "w", method) as archive:
        listed = dict.fromkeys(name.split("/", 1)[1] for name in names if "/" in name and not name.endswith("/"))
        archive.writestr("tiny/SHA256SUMS", "".join(f"{SUM}  {name}\n" for name in listed))
        for name in names:
            entry = zipfile.ZipInfo("placeholder")
            entry.filename = name  # ZipInfo mends some of them
            entry.create_system, entry.external_attr = 3, dict(modes).get(name, stat.S_IFREG | 0o644) << 16
            archive.writestr(entry, b"" if name.endswith("/") else CONTENT)
    return path


def test_a_whole_zip_is_whole_with_folders_of_their_own_too(tmp_path):
    modes = [("tiny/a/", stat.S_IFDIR | 0o755), ("tiny/a/run", stat.S_IFREG | 0o755)]
    assert verify_deposit(packed(tmp_path / "a.zip", "tiny/a/", "tiny/a/run", "tiny/Überblick.md", modes=modes)) == []


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["../x"], "leads elsewhere"),
        (["../../x"], "leads elsewhere"),
        (["tiny/../../x"], "leads elsewhere"),
        (["tiny//x"], "leads elsewhere, or nowhere"),
        (["/etc/x"], "is an absolute path"),
        (["C:/x"], "is an absolute path"),
        (["tiny/a\\b"], "has a backslash"),
        (["tiny/a\x1b[2J"], "cannot be seen"),
        (["tiny/a\nb.zip: whole: 3 files"], "cannot be seen"),
        (["tiny/exe\u202etxt.nc"], "cannot be seen"),
        (["tiny/" + 300 * "x"], "is too long"),
        (["tiny/a", "tiny/a"], "more than once"),
        (["tiny/Read", "tiny/rEAD"], "is Read on some systems"),
        (["tiny/\u00e9", "tiny/e\u0301"], "on some systems"),
        (["tiny/a", "tiny/A/b"], "a: is a file, and the folder of A/b"),
        (["tiny/a", "tiny/a/b"], "a: is a file, and the folder of a/b"),
        (["tiny/a", "other/b"], "allowed: a single folder"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_that_no_deposit_has(names, said, tmp_path):
    found = verify_deposit(packed(tmp_path / "a.zip", *names))
    assert any(said in line for line in found), found
    assert all(map(is_printable, found))
    done = CliRunner().invoke(app, ["verify", str(tmp_path / "a.zip")])
    assert done.exit_code == 1 and "\x1b" not in done.output and "\nb.zip" not in done.output
    assert list(tmp_path.iterdir()) == [tmp_path / "a.zip"]


@pytest.mark.parametrize(
    "mode", [stat.S_IFLNK | 0o777, stat.S_IFCHR | 0o644, stat.S_IFIFO | 0o644, stat.S_IFREG | 0o4755, stat.S_IFDIR]
)
def test_links_devices_and_odd_modes_in_a_zip(mode, tmp_path):
    found = verify_deposit(packed(tmp_path / "a.zip", "tiny/a", modes=[("tiny/a", mode)]))
    assert len(found) == 1 and ("no file" in found[0] or "mode 4755" in found[0])


@pytest.fixture
def folder(tmp_path):
    """A deposit of one file."""
    made = tmp_path / "tiny"
    made.mkdir()
    (made / "a").write_bytes(CONTENT)
    (made / "SHA256SUMS").write_text(f"{SUM}  a\n")
    assert verify_deposit(made) == []
    return made


@pytest.mark.parametrize("target", ["/etc", "/etc/passwd", "/dev/zero", "nothing"])
def test_links_in_a_folder_are_not_followed(target, folder):
    (folder / "link").symlink_to(target)
    with (folder / "SHA256SUMS").open("a") as sums:
        sums.write(f"{SUM}  link\n{SUM}  link/passwd\n")
    assert verify_deposit(folder) == ["link: is no file of its own", "link/passwd: is missing"]


def test_names_in_a_folder_make_no_lines_of_their_own(folder):
    (folder / "b\ntiny: whole: 9 files").touch()
    found = verify_deposit(folder)
    assert len(found) == 2 and all(map(is_printable, found)) and all("b\\ntiny" in line for line in found)


@pytest.mark.parametrize("bit", [stat.S_ISUID, stat.S_ISGID, stat.S_ISVTX])
def test_special_modes_in_a_folder_are_refused(bit, folder):
    (folder / "a").chmod(0o644 | bit)
    assert verify_deposit(folder) == [f"a: has the mode {0o644 | bit:04o}; allowed: no special bits"]


def test_a_pipe_in_a_folder_keeps_nobody_waiting(folder):
    os.mkfifo(folder / "pipe")
    assert verify_deposit(folder) == ["pipe: is no file of its own"]
    assert verify_deposit(folder / "pipe")[0].startswith("pipe: no readable folder or zip archive")


def test_names_outside_are_not_read(folder):
    (folder / "SHA256SUMS").write_text(f"{SUM}  a\n{SUM}  /dev/zero\n{SUM}  ../tiny/a\n")
    assert [line.rpartition(" is ")[2] for line in verify_deposit(folder)] == [
        "no checksum of a file in this folder"
    ] * 2


def test_what_unpacks_to_far_more_is_refused_unread_and_accepted_when_asked(tmp_path):
    small = LIMITS._replace(allowance=1000)
    zeros = bytes(10_000_000)
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("tiny/SHA256SUMS", f"{hashlib.sha256(zeros).hexdigest()}  zeros\n")
        archive.writestr("tiny/zeros", zeros)
    (said,) = verify_deposit(tmp_path / "a.zip", small)
    assert "to 10 MB; allowed: 50 times its size and 1 kB, or more with --large" in said
    assert verify_deposit(tmp_path / "a.zip", NO_LIMITS) == verify_deposit(tmp_path / "a.zip") == []


def test_the_number_of_files_is_bounded(folder, tmp_path):
    (said,) = verify_deposit(folder, LIMITS._replace(files=1))
    assert "holds more than 1 files; allowed: 1, or more with --large" in said
    (said,) = verify_deposit(packed(tmp_path / "a.zip", "tiny/a"), LIMITS._replace(files=1))
    assert "holds 2 files; allowed: 1, or more with --large" in said


def test_no_more_than_a_hundred_flaws_are_told(folder):
    for k in range(150):
        (folder / f"added{k}").touch()
    done = CliRunner().invoke(app, ["verify", str(folder)])
    assert done.exit_code == 1 and "… and 50 more" in done.output and "not whole: 150 problems" in done.output
    assert len(done.output.splitlines()) == 102


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_so_many_names_with_one_twice_do_not_take_their_number_squared(tmp_path, monkeypatch):
    names = [f"tiny/{k}" for k in range(3000)]
    packed(tmp_path / "a.zip", *names, names[7])
    compared = 0

    class Counting(str):
        def __eq__(self, other):
            nonlocal compared
            compared += 1
            return str.__eq__(self, other)

        __hash__ = str.__hash__

        def partition(self, separator):
            return tuple(Counting(part) for part in str.partition(self, separator))

    def infolist(self):
        for entry in self.filelist:
            entry.filename = Counting(entry.filename)
        return self.filelist

    monkeypatch.setattr(zipfile.ZipFile, "infolist", infolist)
    assert verify_deposit(tmp_path / "a.zip") == ["7: is there more than once"]
    assert compared < 20 * len(names)


@pytest.mark.parametrize("declared", [3, 5, 10_000_000])
def test_declared_sizes_are_the_actual_ones(declared, tmp_path):
    path = packed(tmp_path / "a.zip", "tiny/a")
    content = bytearray(path.read_bytes())
    place = content.rindex(b"PK\x01\x02") + 24  # of the uncompressed size, in the last entry of the directory
    assert struct.unpack_from("<I", content, place) == (4,)
    struct.pack_into("<I", content, place, declared)
    path.write_bytes(content)
    (said,) = verify_deposit(path)
    assert said.startswith("a: ")
    with looked_through(path) as found, pytest.raises((ValueError, EOFError, zipfile.BadZipFile)):
        unpack(found, tmp_path)


def test_entries_that_share_their_bytes_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("tiny/SHA256SUMS", "")
        archive.writestr("tiny/a", bytes(1000))
        for k in range(9):
            again = archive.getinfo("tiny/a")
            entry = zipfile.ZipInfo(f"tiny/{k}")
            entry.file_size = entry.compress_size = again.file_size
            entry.CRC, entry.header_offset = again.CRC, again.header_offset
            archive.filelist.append(entry)
    (said,) = verify_deposit(tmp_path / "a.zip")
    assert "its files overlap" in said


def test_entries_that_share_a_few_of_their_bytes_are_refused(tmp_path):
    """One within another, where all of them together have less than the zip."""
    inner = packed(tmp_path / "inner.zip", "tiny/a").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("tiny/SHA256SUMS", "")
        archive.writestr("tiny/outer", inner + bytes(1000))
        outer = archive.getinfo("tiny/outer").header_offset + 30 + len("tiny/outer")
        with zipfile.ZipFile(tmp_path / "inner.zip") as held:
            entry = held.getinfo("tiny/a")
        entry.header_offset += outer
        archive.filelist.append(entry)
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert sum(entry.compress_size for entry in archive.infolist()) < (tmp_path / "a.zip").stat().st_size
    (said,) = verify_deposit(tmp_path / "a.zip")
    assert "its files overlap" in said


def test_names_that_lie_deep_in_one_another_have_a_flaw_each_at_most(tmp_path):
    deep = [f"tiny{k * '/a'}" for k in range(1, 400)]
    names = [*deep, *(f"{deep[-1]}/{k}" for k in range(500))]
    found = verify_deposit(packed(tmp_path / "a.zip", *names))
    assert len(found) == len(deep) and all("is a file, and the folder of" in line for line in found)


@pytest.mark.parametrize("system", [0, 3, 5, 19])
def test_a_link_in_a_zip_is_one_whatever_system_it_is_said_to_be_of(system, tmp_path):
    path = packed(tmp_path / "a.zip", "tiny/a", modes=[("tiny/a", stat.S_IFLNK | 0o777)])
    content = bytearray(path.read_bytes())
    content[content.rindex(b"PK\x01\x02") + 5] = system
    path.write_bytes(content)
    assert verify_deposit(path) == ["tiny/a: is a link, a device or something else that is no file"]


OTHER_NAME = struct.pack("<HHBL", 0x7075, 5 + len(b"tiny/b"), 1, zlib.crc32(b"tiny/a")) + b"tiny/b"


@pytest.mark.parametrize("where", ["before the content", "in the list of contents"])
def test_an_entry_has_one_name(where, tmp_path):
    """Some programs unpack to the second one, and write what nobody has verified."""
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("tiny/SHA256SUMS", f"{SUM}  a\n")
        entry = zipfile.ZipInfo("tiny/a")
        entry.extra = OTHER_NAME
        archive.writestr(entry, CONTENT)
        if where == "before the content":
            entry.extra = b""
    (said,) = verify_deposit(tmp_path / "a.zip")
    assert said == "tiny/a: has a second name, which some programs use in the place of the first"


def test_an_entry_is_called_the_same_in_both_places(tmp_path):
    path = packed(tmp_path / "a.zip", "tiny/a", "tiny/b/", modes=[("tiny/b/", stat.S_IFDIR | 0o755)])
    path.write_bytes(path.read_bytes().replace(b"tiny/b/", b"tiny/c/", 1))
    (said,) = verify_deposit(path)
    assert said == "tiny/b/: has another name in the zip's list of contents than before its content"


@pytest.mark.parametrize(("field", "value"), [(8, zipfile.ZIP_DEFLATED), (18, 2)])
def test_an_entry_has_the_same_size_and_method_in_both_places(field, value, tmp_path):
    path = packed(tmp_path / "a.zip", "tiny/a")
    content = bytearray(path.read_bytes())
    struct.pack_into("<H", content, content.index(b"PK\x03\x04", 4) + field, value)
    path.write_bytes(content)
    assert verify_deposit(path) == [
        "tiny/a: has another size or method in the zip's list of contents than before its content"
    ]


@pytest.mark.parametrize("name", ["", "\0x"])
def test_a_name_of_nothing_is_none(name, tmp_path):
    path = packed(tmp_path / "a.zip", "Q" * max(len(name), 1))
    path.write_bytes(path.read_bytes().replace(b"Q" * max(len(name), 1), name.encode() or b"\0"))
    (said,) = verify_deposit(path)
    assert "the name leads elsewhere, or nowhere" in said or "cannot be seen" in said


def _in_front(content, other):
    return other + content


def _behind(content, other):
    return content + other


def _in_the_comment(content, other):
    return content[:-2] + struct.pack("<H", len(other)) + other


def _between(content, other):
    """In front of the second entry, where the list of contents says that it is."""
    at = content.index(b"PK\x03\x04", 4)
    later = bytearray(content[:at] + other + content[at:])
    for entry, move in ((later.rindex(b"PK\x01\x02") + 42, len(other)), (len(later) - 6, len(other))):
        struct.pack_into("<I", later, entry, struct.unpack_from("<I", later, entry)[0] + move)
    return bytes(later)


@pytest.mark.parametrize("placed", [_in_front, _behind, _in_the_comment, _between])
def test_bytes_that_belong_to_no_file_are_refused(placed, tmp_path):
    """A program that reads a zip from its beginning finds the files of another one there."""
    other = packed(tmp_path / "b.zip", "tiny/GNUmakefile").read_bytes()
    path = packed(tmp_path / "a.zip", "tiny/a")
    path.write_bytes(placed(path.read_bytes(), other))
    found = verify_deposit(path)
    assert len(found) == 1 and ("belong to no file" in found[0] or "has bytes beside its files" in found[0]), found


def test_a_folder_has_no_content(tmp_path):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("tiny/SHA256SUMS", "")
        archive.writestr("tiny/b/", CONTENT)
    assert verify_deposit(path) == ["tiny/b/: is a folder, and has content"]


def test_a_zip_written_in_one_go_is_whole(tmp_path):
    """To a pipe, say: the sizes of its files come after them."""
    plain = packed(tmp_path / "plain.zip", "tiny/a")

    class Pipe(io.BytesIO):
        def seekable(self):
            return False

        def tell(self):
            raise OSError

        seek = tell

    pipe = Pipe()
    with zipfile.ZipFile(plain) as one, zipfile.ZipFile(pipe, "w", zipfile.ZIP_DEFLATED) as other:
        for entry in one.infolist():
            other.writestr(entry.filename, one.read(entry))
    (tmp_path / "a.zip").write_bytes(pipe.getvalue())
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert all(entry.flag_bits & 0x8 for entry in archive.infolist())
    assert verify_deposit(tmp_path / "a.zip") == []


def test_an_encrypted_file_is_said_to_be_one(tmp_path):
    path = packed(tmp_path / "a.zip", "tiny/a")
    content = bytearray(path.read_bytes())
    content[content.rindex(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    assert verify_deposit(path) == ["tiny/a: is encrypted, or compressed by another method than deflate"]


def test_a_large_text_is_not_read_as_a_whole(folder, monkeypatch):
    monkeypatch.setattr("icha.deposit.deposit_files.LARGEST_TEXT", 3)
    with looked_through(folder) as found, pytest.raises(ValueError, match="a: has 4 B; allowed: 3 B"):
        read_file(found, "a")


def test_unpacking_needs_room(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=3))
    with looked_through(folder) as found, pytest.raises(OSError, match="are needed, and 3 B are free"):
        unpack(found, tmp_path)


def test_good_names_are_good():
    for name in ("a", "runs/load/rough/seed1/slope0.3/soft.nc", "inputs/Höhen über Null (2).txt", ".zenodo.json"):
        assert flaw_of_name(name) == ""
