"""A line between the master and the process of an FMU: messages are a length, then bytes."""

from __future__ import annotations

import socket
import struct

from railcosim.master.component import ComponentError, RunEnded
from railcosim.master.fmi.archive import FmuError

SUCCEEDED, FAILED = b"=", b"!"
"""First byte of an answer."""

ERRORS: dict[str, type[Exception]] = {
    kind.__name__: kind for kind in (FmuError, RunEnded, ComponentError)
}
"""What comes up on the one side as it did on the other."""

_LENGTH = struct.Struct("<Q")
_CHUNK = 1 << 16
_LONGEST = 1 << 31
"""Bytes; a serialised state has some 100 kB. A longer message is nonsense."""


class Channel:
    """One end of a line.

    Parameters
    ----------
    line : socket
        Connected; its time-out holds for each piece of a message.
    """

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._received = b""

    def send(self, message: bytes) -> None:
        """Send one message."""
        self._line.sendall(_LENGTH.pack(len(message)) + message)

    def receive(self) -> bytes:
        """Wait for one message.

        Raises
        ------
        EOFError
            If the other side is gone, or talks nonsense.
        TimeoutError
            If it says nothing.
        """
        data = self._received
        while True:
            if len(data) >= _LENGTH.size:
                end = _LENGTH.size + _LENGTH.unpack_from(data)[0]
                if end > _LONGEST:
                    raise EOFError
                if len(data) >= end:
                    self._received = data[end:]
                    return data[_LENGTH.size : end]
            more = self._line.recv(_CHUNK)
            if not more:
                raise EOFError
            data += more
