"""One file for two kinds of Mac: importers of FMI 2.0 look for `darwin64` on either."""

from __future__ import annotations

import struct
from collections.abc import Sequence

MAGIC, THIN = 0xCAFEBABE, 0xFEEDFACF  # of universal files, big-endian; of 64-bit Mach-O
ALIGNMENT = 14  # 2^14 bytes: the pages of arm64
HEADER, ENTRY = struct.Struct(">II"), struct.Struct(">iiIII")


def universal(libraries: Sequence[bytes]) -> bytes:
    """Join shared libraries of different processors.

    Parameters
    ----------
    libraries : sequence of bytes
        64-bit Mach-O files, each for another processor.

    Raises
    ------
    ValueError
        If one is something else.

    References
    ----------
    `mach-o/fat.h` of macOS: a header, an entry a processor, then the files as they are.
    """
    page = 1 << ALIGNMENT
    head, body = HEADER.pack(MAGIC, len(libraries)), b""
    offset = page
    for library in libraries:
        magic, processor, variant = struct.unpack_from("<Iii", library)
        if magic != THIN:
            raise ValueError("a library for macOS is no 64-bit Mach-O file")
        head += ENTRY.pack(processor, variant, offset, len(library), ALIGNMENT)
        padded = library + b"\0" * (-len(library) % page)
        body += padded
        offset += len(padded)
    return head.ljust(page, b"\0") + body
