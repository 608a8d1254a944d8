"""What FMUs say through their logger, kept apart for each instance."""

from __future__ import annotations

import ctypes
import itertools
from collections import Counter, deque
from typing import Any
from weakref import WeakValueDictionary

import fmpy
import fmpy.fmi1
import fmpy.fmi2
import fmpy.fmi3
import fmpy.logging

_STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
_KEPT = 50  # messages; enough for the traceback of a Python FMU
_SHOWN = 3  # warnings
_OTHERS = "others"


class FmuLog:
    """The last messages of one FMU instance.

    Parameters
    ----------
    is_format : bool
        Whether the message is a printf format with arguments, as FMI says. PythonFMU's is not: it
        passes the bare text, in which a ``%s`` would make printf read from nowhere and crash.

    Attributes
    ----------
    key : int
        By which FMUs call it, as their environment.
    messages : deque of (str, str)
        Status and text, oldest first.
    warnings : Counter of str
        Texts of status warning, and how often each came.
    """

    def __init__(self, *, is_format: bool) -> None:
        self.messages: deque[tuple[str, str]] = deque(maxlen=_KEPT)
        self.warnings: Counter[str] = Counter()
        self.key = next(_keys)
        self._is_format = is_format
        _logs[self.key] = self

    def fmi2_callbacks(self) -> Any:
        """The ``fmi2CallbackFunctions`` to instantiate with; must live as long as the instance."""
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        callbacks.logger = _dispatcher
        callbacks.allocateMemory = fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        callbacks.componentEnvironment = self.key
        if self._is_format:
            # Formats the printf arguments in C, and then calls ONE logger for the whole process:
            # the one registered last. Hence one dispatcher for all instances.
            fmpy.logging.addLoggerProxy(ctypes.byref(callbacks))
        return callbacks

    def note(self, status: str, text: str) -> None:
        """Take note of a message."""
        self.messages.append((status, text))
        if status == "warning":
            known = text in self.warnings or len(self.warnings) < _KEPT
            self.warnings[text if known else _OTHERS] += 1

    def warned(self) -> str:
        """What was warned of, once each, with a count; empty for nothing."""
        total = self.warnings.total()
        if not total:
            return ""
        most = self.warnings.most_common(_SHOWN)
        texts = [f"{text} ({n} times)" if n > 1 else text for text, n in most]
        more = len(self.warnings) - len(most)
        texts += [f"and {more} other texts"] if more > 0 else []
        return f"warned {total} time{'s' * (total > 1)}: {' | '.join(texts)}"

    def quote(self) -> str:
        """Make the messages the end of an error message, and forget them."""
        troubles = [text for status, text in self.messages if status != "ok"]
        texts = troubles or [text for _, text in self.messages]
        self.messages.clear()
        return f" The FMU said: {' | '.join(texts[-5:])}" if texts else " The FMU said nothing."


def status_name(status: int) -> str:
    """Name of an FMI status code."""
    return _STATUS[status] if 0 <= status < len(_STATUS) else f"illegal status {status}"


def _dispatch(
    environment: int | None, instance: bytes, status: int, category: bytes, message: bytes
) -> None:
    """Give a message to the log of the instance it comes from."""
    log = _logs.get(environment) if environment is not None else None
    if log is None:  # an instance somebody else made with fmpy in this process
        fmpy.fmi1.printLogMessage(environment, instance, status, category, message)
        return
    text = (message or b"").decode("utf-8", errors="replace").strip()
    log.note(status_name(status), text)


def _dispatch3(environment: int | None, status: int, category: bytes, message: bytes) -> None:
    """The same for FMI 3.0, whose messages are plain text."""
    log = _logs.get(environment) if environment is not None else None
    if log is not None:
        log.note(status_name(status), (message or b"").decode("utf-8", errors="replace").strip())


_keys = itertools.count(1)
_logs: WeakValueDictionary[int, FmuLog] = WeakValueDictionary()
_dispatcher: Any = fmpy.fmi2.fmi2CallbackLoggerTYPE(_dispatch)
fmi3_logger: Any = fmpy.fmi3.fmi3LogMessageCallback(_dispatch3)
