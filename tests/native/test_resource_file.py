"""model.bin truncated, lengthened, altered; and a fuzzer on its reader and all that follows."""

import random
import re
import struct
import warnings
import zlib
from pathlib import Path

import pytest

from railcosim.fmus.content import contents
from railcosim.track.decay import RingWarning
from railcosim.vehicle.files import read_stock

from .fuzzing import build, fuzz, on_profiles

FILES = 3000
HEAD, ENTRY = 32, 64  # bytes; see resource.py
DOUBLE, INT32 = 1, 2
CELLS = 6  # place among the sizes


@pytest.fixture
def fmi():
    return 2  # the reader is the same


@pytest.fixture
def attempt(drivers, tiny, tmp_path):
    """Function that makes an instance from a file with this content, and says why that fails."""
    fmu, driver = tiny["TrackWithContact"], drivers()
    file = tmp_path / "model.bin"

    def make(content):
        file.write_bytes(content)
        reply = driver("new", 0, "cs", fmu.guid, tmp_path.as_uri(), 0)
        if reply.status == "OK":
            driver("free", 0)
            return ""
        assert len(reply.log) == 1
        assert str(file) in reply.log[0]
        return reply.log[0]

    make.whole = (fmu.resources / "model.bin").read_bytes()
    return make


def test_truncated(attempt):
    whole = attempt.whole
    assert attempt(whole) == ""
    (sections,) = struct.unpack_from("<I", whole, 24)
    starts = [HEAD + ENTRY * k for k in range(sections + 1)]
    starts += [struct.unpack_from("<Q", whole, at + 56)[0] for at in starts[:-1]]
    cuts = {start + d for start in starts for d in (-1, 0, 1)} | set(range(40))
    cuts |= {len(whole) // 2, len(whole) - 8, len(whole) - 1}
    for cut in sorted(c for c in cuts if c < len(whole)):
        why = attempt(whole[:cut])
        assert "trunc" in why or "size" in why, (cut, why)


def test_something_added(attempt):
    for more in (1, 8, 4096):
        assert "added" in attempt(attempt.whole + b"\0" * more)


def test_altered(attempt):
    """Any single bit; the checksum sees it, or what stands before it."""
    whole, chance = attempt.whole, random.Random(1)
    places = [*range(HEAD), *(chance.randrange(HEAD, len(whole)) for _ in range(400))]
    for at in places:
        if 28 <= at < HEAD:
            continue  # reserved
        altered = bytearray(whole)
        altered[at] ^= 1 << chance.randrange(8)
        assert attempt(bytes(altered)) != "", at


def whole_with(whole, section, at, value):
    """The file with another number in a section, and the checksum that it then has."""
    altered = bytearray(whole)
    (sections,) = struct.unpack_from("<I", whole, 24)
    for k in range(sections):
        name, kind, *_, offset = struct.unpack_from("<24sII3QQ", whole, HEAD + ENTRY * k)
        if name.rstrip(b"\0").decode() == section:
            form = {DOUBLE: "<d", INT32: "<i"}[kind]
            struct.pack_into(form, altered, offset + at * struct.calcsize(form), value)
    struct.pack_into("<Q", altered, 16, zlib.crc32(altered[HEAD:]))
    return bytes(altered)


def test_memory_without_bound(attempt):
    """A file of 11 kB whose ring has a million cells: 134 MB for the turns of its modes alone."""
    assert attempt(whole_with(attempt.whole, "sizes", CELLS, 5)) == ""
    assert "more memory" in attempt(whole_with(attempt.whole, "sizes", CELLS, 2**20 - 1))


def test_work_without_bound(attempt, tiny):
    """Internal steps may not be shorter than what the interface allows."""
    least = 3 * tiny["TrackWithContact"].references["internal_step"] + 1
    assert attempt(whole_with(attempt.whole, "ranges", least, 1e-7)) == ""
    assert "internal step" in attempt(whole_with(attempt.whole, "ranges", least, 1e-9))


def test_tables_of_profiles(drivers, tiny_track, made, tmp_path):
    """Rows that are nowhere, wheels without a radius, contacts that do not press."""
    wagon = on_profiles(read_stock(Path("wagon")))
    with warnings.catch_warnings(category=RingWarning, action="ignore"):
        four = contents(wagon, tiny_track, dimension="spatial")
    (one,) = (c for c in four if c.name == "VehicleWithContact")
    fmu = made(tmp_path / "fmu", one.body, one.table, one.profiles)
    file, driver = fmu.resources / "model.bin", drivers()
    whole, refused = file.read_bytes(), "table of wheel and rail profiles"
    for section, at, value, said in (
        ("profile.about", 3, 0.0, refused),  # between rows
        ("profile.about", 0, -1.0, refused),  # the wheel's radius
        ("profile.about", 2, 1.0, refused),  # it begins beyond the middle
        ("profile", 10, 0.0, refused),  # Hertz's C of the first row
        ("profile", 3, float("nan"), "not finite"),
    ):
        file.write_bytes(whole_with(whole, section, at, value))
        reply = driver("new", 0, "cs", fmu.guid, fmu.resources.as_uri(), 0)
        assert (reply.status, said in reply.log[0]) == ("NULL", True), (section, at)


def test_something_else(attempt, tmp_path):
    assert "not a model file" in attempt(b"PK\3\4" * 100)
    assert attempt(b"\0" * 1000) != ""


def test_a_folder_in_its_place(drivers, tiny, tmp_path):
    (tmp_path / "model.bin").mkdir()
    reply = drivers()("new", 0, "cs", tiny["Track"].guid, tmp_path.as_uri(), 0)
    assert reply.status == "NULL"
    assert "model.bin" in reply.log[0]


def test_a_location_on_this_host(drivers, tiny):
    place = tiny["Track"].resources
    for uri in (place.as_uri(), f"file://localhost{place}", f"file:{place}"):
        driver = drivers()
        assert driver("new", 0, "cs", tiny["Track"].guid, uri, 0).status != "NULL", uri
        driver.close()
    reply = drivers()("new", 0, "cs", tiny["Track"].guid, f"file://elsewhere{place}", 0)
    assert reply.status == "NULL"
    assert "elsewhere" in reply.log[0]  # a share on Windows, nothing here


@pytest.mark.slow  # compiles with coverage, and runs what was found and some more
def test_fuzzing(tmp_path):
    """Files without a checksum, altered at random where that reaches new code, read and lived with.

    Always alike: the same seed, the same number of files, no limit that depends on the machine. At
    length, and by chance, it is run by hand (`fuzzing.py`).
    """
    if why := build(tmp_path / "fuzz"):
        pytest.skip(why)
    told = fuzz(tmp_path / "fuzz", tmp_path, 1, f"-runs={FILES}", "-timeout=600")
    assert told.returncode == 0, f"{tmp_path}: {told.stderr[-5000:]}"
    counted = dict(re.findall(r"^(?:stat::)?(\w+): +(\d+)$", told.stderr, re.MULTILINE))
    print(counted)
    assert int(counted["number_of_executed_units"]) >= FILES
    assert int(counted["accepted"]) > FILES / 20  # it also gets beyond reading
