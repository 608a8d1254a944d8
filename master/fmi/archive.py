"""Unpacking an FMU or SSP that may come from a stranger: checked, then written to a folder."""

from __future__ import annotations

import errno
import re
import shutil
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from railcosim.storage.temporary import scratch

MAX_TOTAL_SIZE = 2 * 1024**3
"""Largest unpacked size of an archive, bytes; big vendor FMUs reach some 500 MB."""
MAX_ENTRIES = 50_000
"""Largest number of entries in an archive."""
MAX_XML_SIZE = 100 * 1024**2
"""Largest XML file, bytes; as a tree it takes ten times the memory."""

DESCRIPTION = "modelDescription.xml"
OTHERS = {
    ".fmu": "an FMU; railcosim run takes a pair of them",
    ".ssp": "a whole system; railcosim run-system takes it",
    ".toml": "parameters; railcosim export makes FMUs of them",
}
"""What a file is by its ending, where another kind is meant."""
# Characters in the path of the resources that crash some FMUs' hosts: # % + ( and all non-ASCII.
_PLAIN_PATH = re.compile(r"[A-Za-z0-9 _.~:/\\-]+")
_VERSIONS = re.compile(r"2\.0|3\.0([.-].*)?")
# FMI and SSP allow no others. They are also the ones that are unpacked piece by piece: a few bytes
# of another method can fill the memory before they are counted.
_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
# What zipfile raises where the bytes make no sense.
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, NotImplementedError, EOFError, ValueError)


class FmuError(ValueError):
    """Something is wrong with an FMU or SSP file or with what the user asks of it, in one line."""


def unpack(path: Path) -> Path:
    """Check an FMU and extract it; see `unpack_archive`.

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
        If the archive is refused, or its model description has a document type or is of another
        FMI version than 2.0 and 3.0.
    """
    return unpack_archive(path, DESCRIPTION, check_description)


def unpack_archive(path: Path, main: str, check: Callable[[Path, bytes], object]) -> Path:
    """Check a zip archive and extract it.

    Parameters
    ----------
    path : Path
        The archive.
    main : str
        Its entry that says what is in it.
    check : callable
        Given `path` and the text of `main`; raises FmuError if it will not do.

    Returns
    -------
    Path
        A new temporary folder with the contents; the caller removes it.

    Raises
    ------
    FmuError
        If the file is missing, is not a zip archive, holds entries that leave the folder, collide
        or are links, unpacks to more than `MAX_TOTAL_SIZE`, or has no acceptable `main`.
    """
    with _checked(path, main) as archive:
        check(path, archive.read(main))
        return _extract(archive)


def read_annotations(path: Path, tool: str) -> dict[str, dict[str, str]]:
    """What a tool has noted in an FMU's model description.

    In FMI 2.0 these are ``VendorAnnotations``, in FMI 3.0 ``Annotations``.

    Parameters
    ----------
    path : Path
        The ``.fmu`` file.
    tool : str
        Whose annotations.

    Returns
    -------
    dict
        Element to its attributes; empty if there are none.

    Raises
    ------
    FmuError
        As `unpack`.
    """
    with _checked(path, DESCRIPTION) as archive:
        root = parse_xml(f"{path}: {DESCRIPTION}", archive.read(DESCRIPTION))
    noted = [t for t in root.iterfind("VendorAnnotations/Tool") if t.get("name") == tool]
    noted += [t for t in root.iterfind("Annotations/Annotation") if t.get("type") == tool]
    return {element.tag: dict(element.attrib) for t in noted for element in t}


def unpacked_size(path: Path) -> int:
    """Bytes that a zip archive says it unpacks to; `unpack_archive` never writes more.

    Raises
    ------
    FmuError
        If the file is not a zip archive.
    """
    with _opened(path) as archive:
        return sum(entry.file_size for entry in archive.infolist())


def parse_xml(where: str, text: bytes) -> Element:
    """Read XML that may come from a stranger.

    A document type is what entities need, and entities can read local files or grow without
    bound; neither FMI nor SSP has a use for one.

    Parameters
    ----------
    where : str
        Archive and entry, for the message.
    text : bytes
        The XML.

    Returns
    -------
    Element
        Its root.

    Raises
    ------
    FmuError
        If it has a document type, is not well formed, or is longer than `MAX_XML_SIZE`.
    """
    if len(text) > MAX_XML_SIZE:
        size, limit = len(text) / 1e6, MAX_XML_SIZE / 1e6
        raise FmuError(f"{where} has {size:.0f} MB; refused, the limit is {limit:.0f} MB")
    try:
        parser = XMLParser(target=_NoDocumentType(where))
        parser.feed(text)
        root: Element = parser.close()
    except (ParseError, ValueError, LookupError) as error:
        if isinstance(error, FmuError):
            raise
        raise FmuError(f"{where} is not well-formed XML ({error})") from error
    return root


class _NoDocumentType(TreeBuilder):
    """Builds the tree; stops at a document type."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self._where = where

    def doctype(self, *_: object) -> None:
        raise FmuError(f"{self._where} has a DOCTYPE, which may hide entities; refused")


def check_description(path: Path, text: bytes) -> None:
    """Refuse a model description with a document type, or of another FMI version than 2.0 and 3.0.

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
    version = parse_xml(f"{path}: {DESCRIPTION}", text).get("fmiVersion")
    if version is None or not _VERSIONS.fullmatch(version):
        raise FmuError(f"{path}: FMI version {version}; export it as FMI 2.0 or 3.0 Co-Simulation")


@contextmanager
def description_of(path: Path) -> Iterator[Path]:
    """Check an FMU, and extract its model description alone: nothing else is needed to know it.

    Yields
    ------
    Path
        A temporary folder with the model description in it, as long as the block lasts.

    Raises
    ------
    FmuError
        As `unpack`.
    """
    with _checked(path, DESCRIPTION) as archive, TemporaryDirectory(dir=scratch()) as folder:
        text = archive.read(DESCRIPTION)
        check_description(path, text)
        Path(folder, DESCRIPTION).write_bytes(text)
        yield Path(folder)


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open an archive; whatever zipfile says about a damaged one becomes a sentence."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except FmuError:
        raise
    except _DAMAGED as error:
        raise FmuError(f"{path}: not a readable zip archive ({error}); export it again") from error
    except RuntimeError as error:  # zipfile's answer to encryption
        raise FmuError(f"{path}: cannot be unpacked ({error}); export it unencrypted") from error
    except OSError as error:
        if error.errno != errno.EINVAL:  # such as a full disk
            raise
        raise FmuError(
            f"{path}: not a readable zip archive (bad offset); export it again"
        ) from error


@contextmanager
def _checked(path: Path, main: str) -> Iterator[zipfile.ZipFile]:
    """Open an archive whose entries may be written to a folder, and that has its main one."""
    if path.is_dir():
        raise FmuError(f"{path}: is a folder; give {_kind(main)}")
    if not path.is_file():
        raise FmuError(f"{path}: no such file; give the path of a {path.suffix or '.fmu'} file")
    other = {k: v for k, v in OTHERS.items() if k != _ending(main)}.get(path.suffix.lower())
    if other is not None and not zipfile.is_zipfile(path):
        raise FmuError(f"{path}: is not {_kind(main)} but {other}")
    with _opened(path) as archive:
        _check_entries(path, archive.infolist())
        if main not in archive.namelist():
            if other is not None:
                raise FmuError(f"{path}: is not {_kind(main)} but {other}")
            raise FmuError(f"{path}: no {main} at its top level; not {_kind(main)}")
        yield archive


def _ending(main: str) -> str:
    return ".fmu" if main == DESCRIPTION else ".ssp"


def _kind(main: str) -> str:
    """What an archive without its main entry is not."""
    return "an FMU" if main == DESCRIPTION else "an SSP"


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    """Refuse entries that would be written elsewhere or over each other, links, absurd sizes."""
    files: dict[PurePosixPath, tuple[int, int]] = {}
    folders: set[PurePosixPath] = set()
    for entry in entries:
        # Some Windows tools write backslashes; whatever they mean, they must not lead outside.
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in entry.filename:
            raise FmuError(f"{path}: entry {entry.filename!r} leaves the archive's folder; refused")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise FmuError(f"{path}: entry {entry.filename!r} is a symbolic link; refused")
        if entry.compress_type not in _METHODS:
            raise FmuError(
                f"{path}: entry {entry.filename!r} is compressed by method {entry.compress_type}; "
                "export it with deflate"
            )
        folders.update(name.parents)
        if entry.is_dir():
            folders.add(name)
            continue
        # Packed twice is no harm as long as nobody has to guess which one is meant.
        if files.setdefault(name, known := (entry.CRC, entry.file_size)) != known:
            raise FmuError(
                f"{path}: entry {entry.filename!r} is in it twice, and not the same; refused"
            )
    for name in sorted(files.keys() & folders):
        raise FmuError(f"{path}: entry {str(name)!r} is both a file and a folder; refused")
    # The sizes are what the archive states, and zipfile never writes more than is stated.
    total = sum(entry.file_size for entry in entries)
    if total > MAX_TOTAL_SIZE or len(entries) > MAX_ENTRIES:
        raise FmuError(
            f"{path}: {len(entries)} entries of {total / 1e6:.0f} MB unpacked; refused, the limits "
            f"are {MAX_ENTRIES} entries and {MAX_TOTAL_SIZE / 1e6:.0f} MB"
        )


def _extract(archive: zipfile.ZipFile) -> Path:
    """Write the contents to a new temporary folder, whatever the archive's own path looks like."""
    parent = tempfile.gettempdir()
    if not _PLAIN_PATH.fullmatch(parent):
        raise FmuError(
            f"the temporary folder {parent} has characters that crash some FMUs; set the "
            "environment variable TMPDIR to a folder of plain letters and digits"
        )
    folder = Path(tempfile.mkdtemp(prefix="fmu_", dir=scratch()))
    try:
        archive.extractall(folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder
