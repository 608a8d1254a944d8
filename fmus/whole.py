"""Files that are there whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def written_whole(target: Path) -> Iterator[Path]:
    """A place beside `target` to write to, moved there at the end; whatever interrupts leaves none.

    Parameters
    ----------
    target : Path
        The file, replaced if it is there.

    Yields
    ------
    Path
        Where to write.
    """
    partial = target.with_name(f"{target.name}.part")
    try:
        yield partial
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
