"""What is in the binaries, and what compilers say of the sources."""

import re
import shutil
import struct
import subprocess

import numpy as np
import pytest

from railcosim.compiling.platforms import PLATFORMS, local_platform
from railcosim.fmus.native_runtime.compile import SOURCES, build, headers, sources
from railcosim.fmus.native_runtime.universal import universal

MACH_O, MACH_O_DYLIB, SYMBOL_TABLE = 0xFEEDFACF, 6, 2
# -Wconversion not for clang, which takes what its own isfinite() gives for a conversion.
STRICT = ["-std=c99", "-O3", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wstrict-prototypes",
          "-Wmissing-prototypes", "-Wvla", "-Werror", "-fsyntax-only"]  # fmt: skip
# Each library for another system takes zig 3 to 7 s; with a compiler of one's own 40 s in all.
ACROSS = pytest.mark.slow
STRICTER = {"gcc": ["-Wconversion", "-Wsign-conversion"], "clang": []}


def program(name, package):
    if (found := shutil.which(name)) is None:
        pytest.skip(f"no {name}: apt-get install {package}")
    return found


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def declared(fmi):
    """Functions of the standard, from its header, and those of the law for masters, from ours."""
    (header,) = [path for path in headers(fmi) if path.name == f"fmi{fmi}Functions.h"]
    text = header.read_text()
    found = set(re.findall(rf"^\s*FMI{fmi}_Export\s+\w+\s+(fmi{fmi}\w+)\s*;", text, re.MULTILINE))
    assert len(found) > 40
    ours = (SOURCES / "rolling_law.h").read_text()
    return found.union(re.findall(r"^FOR_MASTERS .*?(railcosim_\w+)\(", ours, re.MULTILINE))


def test_plain_c_will_do(tiny, tmp_path, compile_driver, start_driver, use):
    """Compilers that are not GNU's get sums without vectors; here GCC does as they do."""
    # The sums are the same code whatever version of FMI is around them.
    gcc, fmu, runs, fmi = program("gcc", "gcc"), tiny["TrackWithContact"], [], 2
    compile_driver([gcc, "-rdynamic"], fmi, tmp_path / "driver")
    include = sorted({f"-I{path.parent}" for path in headers(fmi)})
    kernels, plain = tmp_path / "kernels.o", tmp_path / "plain.so"
    common = [gcc, "-std=c99", "-O1", "-fPIC", *include]
    output(*common, "-DRAILCOSIM_PLAIN_C", "-c", "-o", str(kernels), str(SOURCES / "kernels.c"))
    others = [str(path) for path in sources(fmi) if path.name != "kernels.c"]
    output(*common, "-shared", "-o", str(plain), str(kernels), *others, "-lm")
    for library in (build(fmi)[local_platform()], plain):
        driver = start_driver([str(tmp_path / "driver"), str(library)], {})
        one, rows = use(driver, fmu, fmi), []
        one.initialise()
        for step in range(5):
            one.move(step)
            assert one("step", step * 1e-3, 1e-3).status == "OK"
            rows.append(list(map(float, one.outputs())))
        driver.close()
        runs.append(np.array(rows))
    vectors, plain = runs
    # Another order of the sums over modes, in 100 internal steps.
    assert (np.abs(plain - vectors) <= 1e-11 * np.abs(vectors).max(axis=0)).all()
    assert np.ptp(plain, axis=0).min() > 0


@pytest.mark.parametrize("compiler", STRICTER)
def test_no_warnings(fmi, compiler):
    gcc = program(compiler, compiler)
    # As a system's: FMI's own headers would not pass.
    folders = sorted({f"-isystem{path.parent}" for path in headers(fmi)})
    flags = [*STRICT, *STRICTER[compiler], *folders]
    told = subprocess.run(
        [gcc, *flags, *map(str, sources(fmi))], capture_output=True, text=True, check=False
    )
    assert told.returncode == 0, told.stderr


def test_the_local_binary_exports_fmi_and_a_law_for_masters(fmi):
    nm = program("nm", "binutils")
    library = build(fmi)[local_platform()]
    lines = output(nm, "--dynamic", "--defined-only", str(library)).splitlines()
    assert {line.split()[-1] for line in lines} == declared(fmi)


def versions_needed(library):
    """Versions of glibc that an ELF library asks for."""
    text = output(program("objdump", "binutils"), "-T", str(library))
    return [tuple(map(int, v.split("."))) for v in re.findall(r"GLIBC_([\d.]+)", text)]


@ACROSS
@pytest.mark.parametrize("name", ["linux64", "aarch64-linux"])
def test_zig_asks_for_an_old_glibc_only(fmi, name, monkeypatch):
    """2.17, of 2012; the system's compiler asks for what the system has."""
    pytest.importorskip("ziglang", reason='no zig: pip install "railcosim[native]"')
    monkeypatch.delenv("CC", raising=False)
    (platform,) = [p for p in PLATFORMS if p.fmi2 == name]
    needed = versions_needed(build(fmi, [platform])[platform])
    assert needed
    assert max(needed) <= (2, 17)


def mach_o_exports(content):
    """Names a Mach-O library exports; it must be one, and not hold other sections than it says."""
    magic, _, _, kind, n_commands, _, _, _ = struct.unpack_from("<8I", content)
    assert (magic, kind) == (MACH_O, MACH_O_DYLIB)
    at = 32
    for _ in range(n_commands):
        command, size = struct.unpack_from("<2I", content, at)
        if command == SYMBOL_TABLE:
            symbols, n, names, _ = struct.unpack_from("<4I", content, at + 8)
        at += size
    found = set()
    for k in range(n):
        name_at, kind, section, _, _ = struct.unpack_from("<IBBHQ", content, symbols + 16 * k)
        if kind & 1 and section:  # external, and defined here
            start = names + name_at
            found.add(content[start : content.index(b"\0", start)].decode().removeprefix("_"))
    return found


@ACROSS
@pytest.mark.parametrize(
    ("name", "cpu"), [("darwin64", 0x01000007), ("aarch64-darwin", 0x0100000C)]
)
def test_the_macos_binary_is_built(fmi, name, cpu):
    """Built and looked at; not run."""
    pytest.importorskip("ziglang", reason='no zig: pip install "railcosim[native]"')
    (platform,) = [p for p in PLATFORMS if p.fmi2 == name]
    content = build(fmi, [platform])[platform].read_bytes()
    assert struct.unpack_from("<I", content, 4) == (cpu,)
    # With an underscore: the linker's own, in every library.
    assert {n for n in mach_o_exports(content) if n[0] != "_"} == declared(fmi)


@ACROSS
def test_one_file_for_both_macs():
    """Taken apart by hand and, where it is, by LLVM's own tool."""
    pytest.importorskip("ziglang", reason='no zig: pip install "railcosim[native]"')
    macs = [p for p in PLATFORMS if p.suffix == ".dylib"]
    thin = [path.read_bytes() for path in build(2, macs).values()]
    both = universal(thin)
    magic, count = struct.unpack_from(">II", both)
    assert (magic, count) == (0xCAFEBABE, 2)
    for k, library in enumerate(thin):
        cpu, variant, offset, size, alignment = struct.unpack_from(">iiIII", both, 8 + 20 * k)
        assert struct.pack("<ii", cpu, variant) == library[4:12]
        assert offset % (1 << alignment) == 0
        assert both[offset : offset + size] == library


@ACROSS
def test_llvm_finds_both_processors(tmp_path):
    pytest.importorskip("ziglang", reason='no zig: pip install "railcosim[native]"')
    lipo = program("llvm-lipo-14", "llvm-14")
    macs = [p for p in PLATFORMS if p.suffix == ".dylib"]
    file = tmp_path / "both.dylib"
    file.write_bytes(universal([path.read_bytes() for path in build(2, macs).values()]))
    assert output(lipo, "-archs", str(file)).split() == ["x86_64", "arm64"]


def test_what_is_no_library_is_refused():
    with pytest.raises(ValueError, match="Mach-O"):
        universal([b"\x7fELF" + bytes(60)])
