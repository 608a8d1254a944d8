"""The master's list of calls in C: under sanitizers; and where its library comes from."""

import os
import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest

from railcosim.compiling.compilers import of_system
from railcosim.compiling.platforms import local_platform
from railcosim.master.batch import library
from railcosim.storage.whole import write_whole

from ..c_compiler import c_compiler

HERE = Path(__file__).parent / "c"


def test_calls_are_made_until_one_has_more_to_say(tmp_path, sanitizing, sanitizers):
    made, headers = tmp_path / "batch", Path(fmpy.__file__).with_name("c-code")
    options = [f"-I{headers}", f'-DBATCH="{library.SOURCE}"', "-UNDEBUG"]
    subprocess.run([*sanitizing(), *options, "-o", made, HERE / "batch.c", "-lm"], check=True)
    told = subprocess.run(
        [made], env=os.environ | sanitizers, capture_output=True, text=True, check=False
    )
    assert (told.returncode, told.stdout, told.stderr) == (0, "all well\n", "")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A copy of the source, where nothing has been compiled, and a new user."""
    (tmp_path / "c").mkdir()
    source = Path(shutil.copy(library.SOURCE, tmp_path / "c"))
    monkeypatch.setattr(library, "SOURCE", source)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    library.in_c.cache_clear()
    yield tmp_path
    library.in_c.cache_clear()


def no_compiler(place, monkeypatch):
    """From now on."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(place))
    library.in_c.cache_clear()


def test_it_is_compiled_once(place, monkeypatch):
    c_compiler()
    assert library.in_c() is not None
    no_compiler(place, monkeypatch)
    assert library.in_c() is not None
    # Another file: this process has the one that was compiled loaded, until it ends.
    write_whole(next((place / "cache" / "railcosim").glob("batch-*")), b"of somebody")
    library.in_c.cache_clear()
    assert library.in_c() is None


def test_without_compiler_it_comes_with_the_installation(place, monkeypatch):
    c_compiler()
    (place / "compiled").mkdir()
    library._make(local_platform(), of_system(), place / "compiled")
    no_compiler(place, monkeypatch)
    assert library.in_c() is not None
    assert not (place / "cache").exists()


def test_without_both_there_is_none(place, monkeypatch):
    no_compiler(place, monkeypatch)
    assert library.in_c() is None


def test_a_compiler_that_fails(place, monkeypatch):
    monkeypatch.setenv("CC", "false")
    assert library.in_c() is None
