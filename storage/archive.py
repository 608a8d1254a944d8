"""ZIP files whose bytes are those of what is in them: no clock, no order of a folder or a set."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Mapping
from pathlib import Path

from .whole import written_whole

READABLE = 0o644 << 16  # a file's permissions, where a ZIP file has them


def write_archive(target: Path, entries: Mapping[str, bytes]) -> str:
    """Write a ZIP file, whole or not at all.

    Parameters
    ----------
    target : Path
        Replaced if it is there.
    entries : mapping of str to bytes
        Content by place in the archive, in the order in which they are written. All have the same
        date, the first that ZIP knows. Archives in the archive are not compressed again.

    Returns
    -------
    str
        Its digest; another process may have replaced it already.
    """
    with written_whole(target) as partial:
        with zipfile.ZipFile(partial, "w") as archive:
            for place, data in entries.items():
                entry = zipfile.ZipInfo(place)
                entry.external_attr = READABLE
                how = zipfile.ZIP_STORED if data[:2] == b"PK" else zipfile.ZIP_DEFLATED
                archive.writestr(entry, data, how)
        return digest_of(partial)


def digest_of(file: Path) -> str:
    """SHA-256 of a file."""
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()
