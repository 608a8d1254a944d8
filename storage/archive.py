"""ZIP files whose bytes are those of what is in them: no clock, no order of a folder or a set."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from .whole import written_whole

READABLE = 0o644 << 16  # a file's permissions, where a ZIP file has them


def write_archive(target: Path, entries: Mapping[str, bytes]) -> None:
    """Write a ZIP file, whole or not at all.

    Parameters
    ----------
    target : Path
        Replaced if it is there.
    entries : mapping of str to bytes
        Content by place in the archive, in the order in which they are written. All have the same
        date, the first that ZIP knows. Archives in the archive are not compressed again.
    """
    with (
        written_whole(target) as partial,
        zipfile.ZipFile(partial, "w") as archive,
    ):
        for place, data in entries.items():
            entry = zipfile.ZipInfo(place)
            entry.external_attr = READABLE
            packed = data[:2] == b"PK"
            archive.writestr(entry, data, zipfile.ZIP_STORED if packed else zipfile.ZIP_DEFLATED)
