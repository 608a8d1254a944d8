"""A file for writers that do not survive an error."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from typing import Any, BinaryIO, TypeVar

_Result = TypeVar("_Result")


class PatientFile(io.RawIOBase):
    """A file whose errors wait for `end`; until then all seems well.

    HDF5 that cannot write what it holds, on a full disk, takes the process with it.

    Parameters
    ----------
    file : binary file
        Open for writing and reading.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._error: OSError | None = None

    def end(self) -> None:
        """Raise the first error, if there was one."""
        self.flush()
        if self._error is not None:
            with contextlib.suppress(OSError):
                self._file.close()  # it would try again
            raise self._error

    def write(self, data: Any) -> int:
        """As a file does, and so the others."""
        return self._try(self._file.write, len(data), data)

    def readinto(self, data: Any) -> int:  # noqa: D102
        read: Callable[[Any], int] = self._file.readinto  # type: ignore[attr-defined]
        return self._try(read, len(data), data)

    def seek(self, place: int, whence: int = 0) -> int:  # noqa: D102
        return self._try(self._file.seek, place, place, whence)

    def tell(self) -> int:  # noqa: D102
        return self._try(self._file.tell, 0)

    def truncate(self, size: int | None = None) -> int:  # noqa: D102
        return self._try(self._file.truncate, size or 0, size)

    def flush(self) -> None:  # noqa: D102
        if not self._file.closed:  # Python flushes what it throws away
            self._try(self._file.flush, None)

    def _try(self, act: Callable[..., _Result], otherwise: _Result, *arguments: Any) -> _Result:
        """Do it; after the first error nothing more is done, only said to be."""
        if self._error is None:
            try:
                return act(*arguments)
            except OSError as error:
                self._error = error
        return otherwise
