"""Where a native FMU can run, and what FMI and the compilers call those places."""

from __future__ import annotations

import platform as machine_facts
import sys
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Platform:
    """One kind of machine.

    Attributes
    ----------
    fmi2, fmi3 : str
        Folder under `binaries/` in FMUs of version 2 and 3. Both name the platform for users.
    target : str
        What zig calls it, with the oldest system the binary is to run on.
    suffix : str
        Of shared libraries.

    References
    ----------
    FMI 2.0.5, section 2.3: `linux64`, `win64` and `darwin64` are x86; all others are named as in
    FMI 3.0, section 2.5.1.4.1.
    """

    fmi2: str
    fmi3: str
    target: str
    suffix: str

    def folder(self, fmi: int) -> str:
        """Folder under `binaries/` in an FMU of version 2 or 3."""
        return {2: self.fmi2, 3: self.fmi3}[fmi]


# glibc 2.17 is of 2012; macOS 11 is the first for arm64.
PLATFORMS = (
    Platform(fmi2="linux64", fmi3="x86_64-linux", target="x86_64-linux-gnu.2.17", suffix=".so"),
    Platform(
        fmi2="aarch64-linux", fmi3="aarch64-linux", target="aarch64-linux-gnu.2.17", suffix=".so"
    ),
    Platform(fmi2="win64", fmi3="x86_64-windows", target="x86_64-windows-gnu", suffix=".dll"),
    Platform(
        fmi2="darwin64", fmi3="x86_64-darwin", target="x86_64-macos.11.0-none", suffix=".dylib"
    ),
    Platform(
        fmi2="aarch64-darwin", fmi3="aarch64-darwin", target="aarch64-macos.11.0-none",
        suffix=".dylib",
    ),
)  # fmt: skip
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "darwin"}  # of sys.platform
ARCHITECTURES = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}


class UnknownPlatform(ValueError):  # noqa: N818 (it says what happened)
    """No such platform, or none that we build for."""


def local_platform() -> Platform:
    """The machine this runs on.

    Raises
    ------
    UnknownPlatform
        If we do not build for it.
    """
    architecture, system = machine_facts.machine(), sys.platform
    name = f"{ARCHITECTURES.get(architecture.lower())}-{SYSTEMS.get(system)}"
    for known in PLATFORMS:
        if known.fmi3 == name:
            return known
    raise UnknownPlatform(
        f"no native FMU can be made for this machine ({system}, {architecture}) itself; "
        f"name others ({_names()}), or take the python runtime"
    )


def platforms_named(text: str) -> tuple[Platform, ...]:
    """Platforms by their names in FMI 2 or FMI 3, as in `linux64,win64`; or `all`.

    Raises
    ------
    UnknownPlatform
        For any other name.
    """
    if text == "all":
        return PLATFORMS
    return tuple(dict.fromkeys(_named(name.strip()) for name in text.split(",")))


def _named(name: str) -> Platform:
    for known in PLATFORMS:
        if name in {known.fmi2, known.fmi3}:
            return known
    raise UnknownPlatform(f"unknown platform {name!r}; known are {_names()}, or all of them: all")


def _names() -> str:
    return ", ".join(known.fmi2 for known in PLATFORMS)
