"""Binaries for other machines: the Windows one under wine, the aarch64 one under qemu.

The same run on each, against the binary for x86_64 Linux.
"""

import shutil
import sys
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from railcosim.compiling.platforms import platforms_named
from railcosim.fmus.native_runtime.compile import build

pytest.importorskip("ziglang", reason='no zig: pip install "railcosim[native]"')
NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"]
LINUX, ARM, WINDOWS = (platforms_named(name)[0] for name in ("linux64", "aarch64-linux", "win64"))
STEP, STEPS, SPEED = 1e-3, 200, 70.0  # s, -, m/s: 14 m, most of the ring


def wine():
    for name in ("wine64", "wine", "/usr/lib/wine/wine64"):
        if found := shutil.which(name):
            return [found]
    return pytest.skip("no wine: apt-get install wine64")


def qemu():
    if (found := shutil.which("qemu-aarch64")) is None:
        pytest.skip("no qemu-aarch64: apt-get install qemu-user")
    system = Path("/usr/aarch64-linux-gnu")
    if not system.is_dir():
        pytest.skip("no C library for aarch64: apt-get install libc6-arm64-cross")
    return [found, "-L", str(system)]


@pytest.fixture(scope="module")
def foreign(tmp_path_factory, compile_driver, start_driver):
    """Function that starts the driver with the binary for a platform."""
    folder = tmp_path_factory.mktemp("foreign")
    wine_folder = str(tmp_path_factory.mktemp("wine") / "prefix")
    made = {}

    def start(fmi, platform):
        runner = {LINUX: list, ARM: qemu, WINDOWS: wine}[platform]()
        if (fmi, platform) not in made:
            library = build(fmi, [platform])[platform]
            program = folder / f"driver{fmi}-{platform.fmi3}.exe"
            # As the runtime is: for other options zig would compile its C library once more.
            zig = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target, "-O3", "-s"]
            compile_driver(zig, fmi, program)
            made[fmi, platform] = [str(program), library]
        program, library = made[fmi, platform]
        # Without a display, and without the messages of a wine that looks for one.
        env = {"WINEPREFIX": wine_folder, "WINEDEBUG": "-all", "DISPLAY": "", "LC_ALL": "C.UTF-8"}
        return start_driver([*runner, program, path_on(platform, library)], env)

    return start


def path_on(platform, path):
    """As the machine calls it: wine shows / as drive Z."""
    return f"Z:{path}" if platform == WINDOWS else str(path)


def run(driver, fmu, fmi, platform):
    """Outputs (steps, outputs) of a run with rolling wheels and loads that swing."""
    where = path_on(platform, fmu.resources)
    uri = f"file:///{where.lstrip('/')}" if fmi == 2 else f"{where}/"
    assert driver("new", 0, "cs", fmu.guid, uri, 0).status == "OK"
    refs = [fmu.references[name] for name in fmu.names("input")]
    wanted = [fmu.references[name] for name in fmu.names("output")]
    assert driver("set_integer", 0, fmu.references["input_hold"], 2).status == "OK"
    assert driver("enter", 0, 0.0).status == "OK"
    assert driver("exit", 0).status == "OK"
    rows = []
    for k in range(STEPS):
        t, values = (k + 1) * STEP, []
        for j, name in enumerate(fmu.names("input")):
            v = fmu.variables[name]
            change = SPEED * t if name.endswith("position") else (
                0.3 * v.nominal * np.sin(2 * np.pi * (20 + j) * t)
            )  # fmt: skip
            values.append(repr(float(v.start + change)))
        assert driver("set", 0, len(refs), *refs, *values).status == "OK"
        reply = driver("step", 0, repr(k * STEP), STEP)
        assert reply.status == "OK", reply
        rows.append(driver("get", 0, len(wanted), *wanted).numbers)
    driver("free", 0)
    return np.array(rows)


@pytest.mark.parametrize("platform", [ARM, WINDOWS], ids=lambda p: p.fmi2)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow  # a minute at the first Windows build: nothing else shows that it runs there
def test_the_same_run_elsewhere(foreign, tiny, fmi, platform, name):
    found = []
    for each in (LINUX, platform):
        driver = foreign(fmi, each)
        found.append(run(driver, tiny[name], fmi, each))
        driver.close()
    here, there = found
    assert np.ptp(here, axis=0).max() > 0  # something happened
    # The statements are the same. What a processor fuses differs, and so may exp, sin and cos: the
    # last bit of a step, and there are 4000 internal ones. Where something hardly moves, the parts
    # it is the sum of are what is rounded; a hundredth of the typical size stands for them.
    typical = [0.01 * tiny[name].variables[v].nominal for v in tiny[name].names("output")]
    size = np.maximum(np.abs(here).max(axis=0), typical)
    assert (np.abs(there - here) <= 4000 * 2.3e-16 * size).all()
    print(name, platform.fmi2, (np.abs(there - here) / size).max())


@pytest.mark.slow  # as above
def test_a_windows_folder_with_signs_in_its_name(foreign, tiny, fmi, tmp_path):
    """FMI's paths are UTF-8; those of Windows' C library are not."""
    fmu = tiny["Vehicle"]
    folder = tmp_path / "100%_ä#(+)é"
    folder.mkdir()
    (folder / "model.bin").write_bytes((fmu.resources / "model.bin").read_bytes())
    place = f"file:///Z:{quote(str(folder))}" if fmi == 2 else f"Z:{folder}"
    driver = foreign(fmi, WINDOWS)
    reply = driver("new", 0, "cs", fmu.guid, place, 0)
    assert reply.status == "OK", reply
    driver.close()
