"""When a request to end is obeyed: Ctrl-C, and SIGTERM and SIGHUP alike.

Usually at once, by an exception. A run obeys at its next point (`noting`), and results are written
to their end first (`finishing`).
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "the terminal was closed"}
_SIGNALS = {s: text for name, text in _WORDS.items() if (s := getattr(signal, name, None))}


class Terminated(KeyboardInterrupt):
    """The process is asked to end by a signal; the message is a word for people."""


class _Requests:
    """What was asked for inside blocks of `noting` and `finishing`.

    Attributes
    ----------
    blocks : list of bool
        Whether each block, from outside, is one of `finishing`.
    first : int or None
        The first signal.
    last : int
        The last one that was raised.
    obeyed : bool
        Whether it was raised already.
    """

    def __init__(self) -> None:
        self.blocks: list[bool] = []
        self.before: dict[int, Any] = {}
        self.first: int | None = None
        self.last: int = signal.SIGINT
        self.obeyed = False

    def note(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: take note, and raise if it is the second one that finds no answer."""
        if self.first is None:
            self.first = number
        elif not self.blocks[-1] and not (self.obeyed and any(self.blocks)):
            self.obey()

    def obey(self) -> None:
        """Raise."""
        self.obeyed = True
        assert self.first is not None
        _raise(self.first)

    def begin(self, finish: bool) -> None:
        if not self.blocks:
            self.first, self.obeyed = None, False
            for number in _SIGNALS:
                # What is ignored stays so (nohup), and what Python does not know stays C's.
                if signal.getsignal(number) not in {signal.SIG_IGN, None}:
                    self.before[number] = signal.signal(number, self.note)
        self.blocks.append(finish)

    def end(self) -> None:
        self.blocks.pop()
        if self.blocks:
            return
        for number, handler in self.before.items():
            signal.signal(number, handler)
        self.before.clear()
        if self.first is not None and not self.obeyed:
            signal.raise_signal(self.first)  # to whom it would have gone


_requests = _Requests()


def obey_all() -> None:
    """Let SIGTERM and SIGHUP raise `Terminated`, as Ctrl-C raises KeyboardInterrupt."""
    for number in _SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _raise)


@contextmanager
def noting() -> Iterator[Callable[[], None]]:
    """A block that is interrupted only where it calls what it is given.

    Anywhere else it could end an FMU written in Python, and with it what a run has recorded. A
    second request does not wait for the call.
    """
    with _block(finish=False):
        yield _check


@contextmanager
def finishing() -> Iterator[None]:
    """A block that comes to its end first.

    Blocks of `noting` in it are interrupted as ever, once; what is then left of it is finished.
    """
    with _block(finish=True):
        yield


def _check() -> None:
    if _requests.first is not None and not _requests.obeyed:
        _requests.obey()


@contextmanager
def _block(finish: bool) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # signals go to the main thread
        return
    _requests.begin(finish)
    try:
        yield
    finally:
        _requests.end()


def reason() -> str:
    """A word for the last request that was obeyed."""
    return _SIGNALS[signal.Signals(_requests.last)]


def _raise(number: int, frame: FrameType | None = None) -> None:
    _requests.last = number
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise Terminated(_SIGNALS[signal.Signals(number)])
