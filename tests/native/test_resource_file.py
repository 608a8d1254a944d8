"""model.bin truncated, lengthened, altered; and a fuzzer on its reader and all that follows."""

import os
import random
import re
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from railcosim.fmus.native_runtime.compile import SOURCES, sources

FUZZING = 15  # s; some 3000 files a second
HERE = Path(__file__).parent / "c"
HEAD, ENTRY = 32, 64  # bytes; see resource.py
FLAGS = ["-std=c99", "-g", "-O1", "-fno-omit-frame-pointer", "-DRAILCOSIM_FUZZING"]


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


@pytest.mark.slow  # what a fuzzer finds it finds in time
def test_fuzzing(tiny, tmp_path, tmp_path_factory):
    """Files without a checksum, altered at random where that reaches new code, read and lived with.

    What it finds is left as `crash-*` in the folder the message names.
    """
    clang = shutil.which("clang")
    if clang is None:
        pytest.skip("no clang: apt-get install clang libclang-rt-dev")
    program = tmp_path / "fuzz"
    files = [str(p) for p in sources(2) if not p.name.startswith("fmi")]
    made = subprocess.run(
        [clang, *FLAGS, "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all",
         f"-I{SOURCES}", "-o", str(program), os.fspath(HERE / "fuzz.c"), *files, "-lm"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if "libclang_rt.fuzzer" in made.stderr:
        pytest.skip("clang without its fuzzer: apt-get install libclang-rt-dev")
    assert made.returncode == 0, made.stderr
    corpus, seeds = tmp_path / "corpus", tmp_path / "seeds"
    corpus.mkdir()
    seeds.mkdir()
    for name, fmu in tiny.items():
        shutil.copy(fmu.resources / "model.bin", seeds / name)
    told = subprocess.run(
        [str(program), f"-max_total_time={FUZZING}", "-timeout=60", "-rss_limit_mb=2000",
         "-len_control=0",  # else it begins with short files, and cuts ours
         "-print_final_stats=1", "-artifact_prefix=" + f"{tmp_path}/", str(corpus), str(seeds)],
        capture_output=True, text=True, check=False,
        env=os.environ | {"ASAN_OPTIONS": "allocator_may_return_null=1"},
    )  # fmt: skip
    assert told.returncode == 0, f"{tmp_path}: {told.stderr[-5000:]}"
    counted = dict(re.findall(r"^(?:stat::)?(\w+): +(\d+)$", told.stderr, re.MULTILINE))
    print(counted)
    assert int(counted["number_of_executed_units"]) > 100 * FUZZING
    assert int(counted["accepted"]) > FUZZING  # it also gets beyond reading
