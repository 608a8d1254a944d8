"""Layered standards in an FMU: recognised, and said where they ask for what is not done here."""

from __future__ import annotations

import warnings
from pathlib import Path

from railcosim.master.fmi.archive import FmuError, parse_xml

_MEANINGS = {
    "xcp": "measurement and calibration by XCP",
    "bus": "network communication",
    "struct": "arrays and maps as one signal",
}
"""What the standards of the FMI project are for; ours to know."""
_HARMLESS = {"ref", "dae"}
"""Those that change nothing of a co-simulation: reference results, equations beside states."""
_MANIFEST = "fmi-ls-manifest.xml"
_told: set[str] = set()


class LayerWarning(UserWarning):
    """An FMU uses a layered standard of which this master does nothing."""


def tell_layers(path: Path, folder: Path) -> None:
    """Say once for each file what layered standards it uses that are not used here.

    Parameters
    ----------
    path, folder : Path
        The FMU, and where it is unpacked.

    Warns
    -----
    LayerWarning
        With all of them.
    """
    found = []
    for manifest in sorted(folder.glob(f"extra/*/{_MANIFEST}")):
        name, version = _identity(manifest)
        short = name.rpartition("fmi-ls-")[2]
        if short in _HARMLESS:
            continue
        meaning = _MEANINGS.get(short)
        found.append(f"{name} {version}".strip() + (f" ({meaning})" if meaning else ""))
    if not found:
        return
    text = (
        f"{path.name}: uses the layered standards {', '.join(found)}, of which nothing is done "
        "here: its variables are coupled one by one"
    )
    if text not in _told:
        _told.add(text)
        warnings.warn(text, LayerWarning, stacklevel=3)


def _identity(manifest: Path) -> tuple[str, str]:
    """Name and version that a manifest states; else that of its folder."""
    try:
        root = parse_xml(manifest.name, manifest.read_bytes())
    except (FmuError, OSError):
        return manifest.parent.name, ""
    stated = {key.rpartition("}")[2]: value for key, value in root.attrib.items()}
    return stated.get("fmi-ls-name", manifest.parent.name), stated.get("fmi-ls-version", "")
