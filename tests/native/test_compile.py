"""How the runtime is compiled, kept and refused; a stub stands for its sources."""

import ctypes
import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from railcosim.compiling import compilers, kept, platforms
from railcosim.compiling.platforms import (
    PLATFORMS,
    UnknownPlatform,
    local_platform,
    platforms_named,
)
from railcosim.fmus.native_runtime import compile as compiling
from railcosim.fmus.native_runtime.compile import (
    CacheRefused,
    CompilationFailed,
    CompilerMissing,
    build,
)

FRONT = """#include "fmi{0}Functions.h"
#include "common.h"
const char *fmi{0}GetVersion(void) {{ return common(); }}
"""
WINDOWS = platforms_named("win64")[0]
# Another process that builds, from the sources of a folder.
BUILDS = """import sys; from pathlib import Path
from railcosim.fmus.native_runtime import compile as compiling
compiling.SOURCES = Path(sys.argv[1])
sys.stdin.readline()
print(*compiling.build(2).values())"""


@pytest.fixture
def stub(tmp_path, monkeypatch):
    """Sources with two fronts and a common part, an empty cache; its folder."""
    sources = tmp_path / "home ä" / "c"  # as a user's home might be called
    sources.mkdir(parents=True)
    for fmi in (2, 3):
        (sources / f"fmi{fmi}.c").write_text(FRONT.format(fmi))
    (sources / "common.h").write_text("const char *common(void);\n")
    (sources / "common.c").write_text(
        '#include "common.h"\nconst char *common(void) { return "2.0"; }\n'
    )
    monkeypatch.setattr(compiling, "SOURCES", sources)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache ä"))
    monkeypatch.delenv("CC", raising=False)
    return sources


@pytest.fixture
def counted(stub, tmp_path, monkeypatch):
    """The system's compiler as `$CC`, each call of which leaves a line in a file; that file."""
    if shutil.which("cc") is None:
        pytest.skip("no C compiler: apt install gcc")
    calls, wrapper = tmp_path / "calls", tmp_path / "counted-cc"
    wrapper.write_text(f'#!/bin/sh\necho "$@" >> "{calls}"\nexec cc "$@"\n')
    wrapper.chmod(0o755)
    monkeypatch.setenv("CC", str(wrapper))

    def compilations():
        lines = calls.read_text().splitlines() if calls.exists() else []
        return sum("--version" not in line for line in lines)

    return compilations


def no_zig(monkeypatch):
    def absent(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(compilers, "version", absent)


def version_of(library, fmi):
    function = getattr(ctypes.CDLL(str(library)), f"fmi{fmi}GetVersion")
    function.restype = ctypes.c_char_p
    return function()


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_library_for_this_machine(counted, fmi):
    told = []
    library = build(fmi, progress=told.append)[local_platform()]
    assert version_of(library, fmi) == b"2.0"
    with pytest.raises(AttributeError):  # hidden
        _ = ctypes.CDLL(str(library)).common
    with pytest.raises(AttributeError):  # the other front
        version_of(library, 5 - fmi)
    assert told == [f"compiling for {local_platform().fmi2}"]


def test_compiled_once(counted):
    told = []
    first = build(2)
    assert build(2, progress=told.append) == first
    assert counted() == 1
    assert told == []


def test_what_is_left_to_compile_is_told_and_for_how_long(stub, monkeypatch):
    """By what the first took: three platforms are compiled, one after the other."""
    monkeypatch.setattr(compiling, "make", lambda fmi, platform, *more: stub / platform.fmi2)
    monkeypatch.setattr(compiling, "compiler_for", lambda platform: compilers.Compiler(("cc",), ""))
    told = []
    made = build(2, platforms_named("linux64,win64,darwin64"), told.append)
    assert set(made.values()) == {stub / name for name in ("linux64", "win64", "darwin64")}
    assert told[0] == "compiling for darwin64, linux64, win64"
    assert [re.sub("for .* [(]|[0-9]+ s", "", words) for words in told[1:]] == [
        "compiling 1 took : about 0 more)", "compiling 2 took : about 0 more)"
    ]  # fmt: skip


@pytest.mark.parametrize("change", ["common.c", "common.h", "compiler", "version of FMI"])
def test_compiled_again_when_something_changed(counted, stub, change, monkeypatch):
    first = build(2)[local_platform()]
    if change == "compiler":
        monkeypatch.setattr(
            compilers, "_system", lambda c: compilers.Compiler(tuple(c), "version 2")
        )
    elif change != "version of FMI":
        path = stub / change
        path.write_text(path.read_text() + "\n")
    second = build(3 if change == "version of FMI" else 2)[local_platform()]
    assert second != first
    assert counted() == 2
    assert first.is_file()  # another release of railcosim may still use it


def test_sources_that_change_under_the_compiler(stub, tmp_path, monkeypatch):
    """What is kept under a name was made of what the name says."""
    if shutil.which("cc") is None:
        pytest.skip("no C compiler: apt install gcc")
    common, wrapper = stub / "common.c", tmp_path / "slow-cc"
    edit = f"""sed -i s/2[.]0/9.9/ '{common}'\n"""
    wrapper.write_text(f'#!/bin/sh\ncase "$*" in *--version*) ;; *) {edit};; esac\nexec cc "$@"\n')
    wrapper.chmod(0o755)
    monkeypatch.setenv("CC", str(wrapper))
    before = common.read_text()
    build(2)
    assert common.read_text() != before
    common.write_text(before)  # it is edited again, and there is nothing to compile
    assert version_of(build(2)[local_platform()], 2) == b"2.0"


def test_four_processes_at_once_get_whole_libraries(counted, stub):
    """All have found nothing when the first one is done, or begin when it is: either is well."""
    others = [
        subprocess.Popen(
            [sys.executable, "-c", BUILDS, str(stub)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for _ in range(4)
    ]  # fmt: skip
    for other in others:
        print(file=other.stdin, flush=True)
    made = {other.communicate(timeout=1800)[0].strip() for other in others}
    assert [other.returncode for other in others] == [0] * 4
    assert len(made) == 1
    library = Path(made.pop())
    assert version_of(library, 2) == b"2.0"
    assert list(library.parent.iterdir()) == [library]  # nothing half-made


@pytest.mark.parametrize("damage", ["half", "nothing", "one bit", "other code"])
def test_a_damaged_library_is_made_again(counted, damage):
    library = build(2)[local_platform()]
    whole = library.read_bytes()
    library.write_bytes({
        "half": whole[: len(whole) // 2],
        "nothing": b"",
        "one bit": whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:],
        "other code": b"\x7fELF of somebody",
    }[damage])  # fmt: skip
    again = build(2)[local_platform()]
    assert counted() == 2
    assert again.read_bytes() == whole
    assert version_of(again, 2) == b"2.0"


def mode(path):
    return path.stat().st_mode & 0o777


def test_the_cache_is_its_users_alone(counted, stub):
    folder = build(2)[local_platform()].parent
    assert mode(folder) == 0o700
    folder.chmod(0o755)  # as it was made before; others could read only
    build(2)
    assert mode(folder) == 0o700
    assert counted() == 1


@pytest.mark.parametrize("writable", [0o777, 0o770, 0o1777])
def test_a_cache_that_others_can_write_in(counted, stub, writable):
    """Whoever can write there has code run: it is refused, whatever lies in it."""
    folder = build(2)[local_platform()].parent
    folder.chmod(writable)
    with pytest.raises(CacheRefused, match=r"others may write in it.*remove it, or set XDG"):
        build(2)


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="root can give away")
def test_another_users_cache(counted, stub):
    folder = build(2)[local_platform()].parent
    os.chown(folder, 12345, -1)
    with pytest.raises(CacheRefused, match="belongs to user 12345"):
        build(2)


def brought(stub, fmi=2):
    """A library beside the sources, as an installation without a compiler brings it."""
    (compiled := stub.parent / "compiled").mkdir()
    made = build(fmi)[local_platform()].read_bytes()
    name = compiling.stem_of(fmi, local_platform())
    return kept.keep(compiled, name, local_platform().suffix, made)


def test_what_was_installed_needs_no_compiler_and_no_cache(counted, stub, monkeypatch):
    library = brought(stub)
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", str(stub))
    monkeypatch.setenv("XDG_CACHE_HOME", str(stub / "common.c" / "no folder"))
    no_zig(monkeypatch)
    told = []
    assert build(2, progress=told.append) == {local_platform(): library}
    assert told == []
    with pytest.raises(CompilerMissing):
        build(3)


def test_a_compiler_that_is_named_goes_first(counted, stub):
    library = brought(stub)
    assert build(2)[local_platform()].parent != library.parent


@pytest.mark.parametrize("change", ["the library", "a source", "a header"])
def test_what_was_installed_is_not_believed_either(counted, stub, monkeypatch, change):
    library = brought(stub)
    monkeypatch.delenv("CC")
    no_zig(monkeypatch)
    path = {"the library": library, "a source": stub / "common.c", "a header": stub / "common.h"}[
        change
    ]
    path.write_bytes(path.read_bytes() + b"\n")
    assert build(2)[local_platform()].parent != library.parent


def test_the_compilers_own_words(counted, stub):
    (stub / "common.c").write_text("int common(void) { return missing_thing; }\n" * 40)
    with pytest.raises(CompilationFailed, match="missing_thing") as failed:
        build(2)
    assert str(stub / "common.c") in str(failed.value)  # the command, to try by hand
    assert len(str(failed.value).splitlines()) < 12
    cache = stub.parent.parent / "cache ä" / "railcosim"
    assert list(cache.iterdir()) == []


def test_a_cache_that_cannot_be_written(counted, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(CompilationFailed, match="XDG_CACHE_HOME"):
        build(2)


def test_nobody_is_at_home(counted, monkeypatch):
    """As in a container that runs under a number."""

    def homeless():
        raise RuntimeError

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(kept.Path, "home", homeless)
    with pytest.raises(CacheRefused, match="XDG_CACHE_HOME"):
        build(2)


def test_no_compiler_at_all(stub, monkeypatch):
    no_zig(monkeypatch)
    monkeypatch.setenv("PATH", str(stub))
    with pytest.raises(CompilerMissing) as missing:
        build(2)
    for way_out in (
        "install railcosim anew",
        "apt install gcc",
        'pip install "railcosim[native]"',
        "--runtime python",
    ):
        assert way_out in str(missing.value)


def test_a_wrong_cc(stub, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(CompilerMissing, match=r"'no-such-compiler -m64'.*variable CC"):
        build(2)


def test_a_cc_that_is_no_command(stub, monkeypatch):
    monkeypatch.setenv("CC", 'gcc "-m64')
    with pytest.raises(CompilerMissing, match=r"CC = 'gcc \"-m64'.*quotation"):
        build(2)


def test_a_foreign_platform_without_zig(stub, monkeypatch):
    no_zig(monkeypatch)
    foreign = next(p for p in PLATFORMS if p != local_platform())
    with pytest.raises(CompilerMissing, match=rf"{foreign.fmi2}.*railcosim\[native\]"):
        build(2, [foreign])


def test_a_machine_we_do_not_know(stub, monkeypatch):
    monkeypatch.setattr(platforms.machine_facts, "machine", lambda: "riscv64")
    with pytest.raises(UnknownPlatform, match="riscv64"):
        build(2)


def test_names_of_platforms():
    assert platforms_named("all") == PLATFORMS
    assert platforms_named("win64, x86_64-windows") == (WINDOWS,)
    assert [p.folder(2) for p in PLATFORMS] == [
        "linux64", "aarch64-linux", "win64", "darwin64", "aarch64-darwin"
    ]  # fmt: skip
    with pytest.raises(UnknownPlatform, match=r"'win32'.*win64"):
        platforms_named("linux64,win32")


def test_importing_it_needs_no_zig():
    module = "railcosim.fmus.native_runtime.compile"
    code = f"import sys, {module}; print('ziglang' in sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "False\n"
