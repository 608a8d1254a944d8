"""Unpacking an FMU that may come from a stranger: checked first, then written to a plain path."""

from __future__ import annotations

import re
import shutil
import stat
import tempfile
import zipfile
from pathlib import Path, PurePosixPath
from xml.parsers import expat

MAX_TOTAL_SIZE = 2 * 1024**3
"""Largest unpacked size of an archive, bytes; big vendor FMUs reach some 500 MB."""
MAX_ENTRIES = 50_000
"""Largest number of entries in an archive."""

_DESCRIPTION = "modelDescription.xml"
# Characters in the path of the resources that crash some FMUs' hosts: # % + ( and all non-ASCII.
_PLAIN_PATH = re.compile(r"[A-Za-z0-9 _.~:/\\-]+")


class FmuError(ValueError):
    """Something is wrong with an FMU file or with what the user asks of it, in one clear line."""


def unpack(path: Path) -> Path:
    """Check an FMU archive and extract it.

    Parameters
    ----------
    path : Path
        The ``.fmu`` file.

    Returns
    -------
    Path
        A new temporary folder with the contents; the caller removes it.

    Raises
    ------
    FmuError
        If the file is missing, is not a zip archive, holds entries that leave the folder or are
        links, unpacks to more than `MAX_TOTAL_SIZE`, or has no acceptable model description.
    """
    if not path.is_file():
        raise FmuError(f"{path}: no such file; give the path of a .fmu file")
    try:
        with zipfile.ZipFile(path) as archive:
            _check_entries(path, archive.infolist())
            check_description(path, _read_description(path, archive))
            return _extract(archive)
    except (zipfile.BadZipFile, NotImplementedError, EOFError, UnicodeDecodeError) as error:
        raise FmuError(f"{path}: not a readable zip archive ({error}); export it again") from error
    except RuntimeError as error:  # zipfile's answer to encryption
        raise FmuError(f"{path}: cannot be unpacked ({error}); export it unencrypted") from error


def check_description(path: Path, text: bytes) -> None:
    """Refuse a model description with a document type, or of another FMI version than 2.0.

    A document type is what entities need, and entities can read local files or grow without
    bound; no FMU has a use for one.

    Parameters
    ----------
    path : Path
        The FMU, for the message.
    text : bytes
        The XML.

    Raises
    ------
    FmuError
        Saying which of the two it is, or that the XML is not well formed.
    """
    versions: list[str | None] = []

    def on_doctype(*_: object) -> None:
        raise FmuError(f"{path}: {_DESCRIPTION} has a DOCTYPE, which may hide entities; refused")

    def on_element(_: str, attributes: dict[str, str]) -> None:
        if not versions:
            versions.append(attributes.get("fmiVersion"))

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = on_doctype
    parser.StartElementHandler = on_element
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise FmuError(f"{path}: {_DESCRIPTION} is not well-formed XML ({error})") from error
    if versions[0] != "2.0":
        raise FmuError(f"{path}: FMI version {versions[0]}; export it as FMI 2.0 Co-Simulation")


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    """Refuse entries that would be written elsewhere, links, and absurd sizes."""
    for entry in entries:
        # Some Windows tools write backslashes; whatever they mean, they must not lead outside.
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in entry.filename:
            raise FmuError(f"{path}: entry {entry.filename!r} leaves the archive's folder; refused")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise FmuError(f"{path}: entry {entry.filename!r} is a symbolic link; refused")
    # The sizes are what the archive states, and zipfile never writes more than is stated.
    total = sum(entry.file_size for entry in entries)
    if total > MAX_TOTAL_SIZE or len(entries) > MAX_ENTRIES:
        raise FmuError(
            f"{path}: {len(entries)} entries of {total / 1e6:.0f} MB unpacked; refused, the limits "
            f"are {MAX_ENTRIES} entries and {MAX_TOTAL_SIZE / 1e6:.0f} MB"
        )


def _read_description(path: Path, archive: zipfile.ZipFile) -> bytes:
    """Read the text of the model description."""
    try:
        return archive.read(_DESCRIPTION)
    except KeyError:
        raise FmuError(f"{path}: no {_DESCRIPTION} at its top level; not an FMU") from None


def _extract(archive: zipfile.ZipFile) -> Path:
    """Write the contents to a new temporary folder, whatever the FMU's own path looks like."""
    folder = Path(tempfile.mkdtemp(prefix="railcosim_fmu_"))
    try:
        if not _PLAIN_PATH.fullmatch(str(folder)):
            raise FmuError(
                f"the temporary folder {folder.parent} has characters that crash some FMUs; set "
                "the environment variable TMPDIR to a folder of plain letters and digits"
            )
        archive.extractall(folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder
