"""A Python process that runs one FMU, seen from the master: commands, questions, and its end."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import threading
import weakref
from collections import deque
from pathlib import Path
from typing import Any, NoReturn

from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.channel import ERRORS, FAILED, Channel

_START_LIMIT = 60.0
"""Seconds in which Python starts, on a busy machine too, and the FMU is instantiated."""
_LAST_WORDS = 1000
"""Bytes of what the process printed that are quoted when it ends."""
_HARMLESS = {"write_inputs", "read_outputs", "drop_state"}
"""Commands that are not named in errors beside others."""
_NAMED = 3
"""Commands that an error names."""
_Command = tuple[bool, str, tuple[Any, ...]]


class FmuProcess:
    """The process of one FMU, and the line to it.

    Parameters
    ----------
    name : str
        Of the component, for errors.
    file, folder : Path
        The FMU, and where it is unpacked; removed at the end.
    limit : float
        Seconds that an answer may take.

    Attributes
    ----------
    is_open : bool
        Whether it can be asked.
    dropped : deque of int
        Keys of snapshots that nobody needs any more.
    """

    def __init__(self, name: str, file: Path, folder: Path, limit: float) -> None:
        self.is_open = True
        self.dropped: deque[int] = deque()
        self._name, self._limit = name, max(limit, _START_LIMIT)
        self._waiting: list[_Command] = []
        self._unanswered: list[_Command] = []
        self._line, theirs = socket.socketpair()
        self._line.settimeout(self._limit)
        self._channel = Channel(self._line)
        module = "railcosim.master.fmi.isolated_process"
        with theirs:
            self._child = subprocess.Popen(
                [sys.executable, "-P", "-m", module, str(theirs.fileno()), name, file, folder],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C is for the master
            )
        self._printed = _LastWords(self._child)
        self._finish = weakref.finalize(self, _end, self._child, self._line, folder)
        self.ask("ready")
        self._limit = limit
        self._line.settimeout(limit)

    def tell(self, command: str, *arguments: Any) -> None:
        """Have something done, later."""
        self._waiting.append((False, command, arguments))

    def ask(self, command: str, *arguments: Any) -> bytes:
        """Have all that was told done, and then this, and wait for the answer.

        Raises
        ------
        FmuError, ComponentError
            As the FMU's side did; ComponentError as well if the process ended or hangs.
        """
        self._waiting.append((True, command, arguments))
        self.flush()
        try:
            answer = self._channel.receive()
        except BaseException as error:
            self._fail(error)
        self._unanswered.clear()
        if answer[:1] == FAILED:
            kind, text = json.loads(answer[1:])
            raise ERRORS[kind](text)
        return answer[1:]

    def flush(self) -> None:
        """Send what is waiting."""
        commands, self._waiting = self._waiting, []
        if not self.is_open:
            raise FmuError(f"{self._name}: closed, or its process has ended; load it again")
        while self.dropped:
            commands.append((False, "drop_state", (self.dropped.popleft(),)))
        self._unanswered += commands
        try:
            self._channel.send(pickle.dumps(commands))
        except BaseException as error:
            self._fail(error)

    def end(self) -> None:
        """End the process, whatever it is doing, and remove its folder."""
        self.is_open = False
        self._finish()

    def _fail(self, error: BaseException) -> NoReturn:
        """Say what happened to the line; the process is of no use after it."""
        if isinstance(error, TimeoutError):
            self.end()
            raise ComponentError(
                f"{self._name}: its process did not answer within {self._limit:g} s to "
                f"{self._asked()}; it was stopped"
            ) from None
        if isinstance(error, EOFError | OSError):
            # It may be still ending; if it has closed the line and lives on, it is stopped.
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._child.wait(1.0)
            self.end()
            raise ComponentError(
                f"{self._name}: its process {_how_it_ended(self._child.returncode)} in "
                f"{self._asked()}.{self._printed.quote()}"
            ) from None
        self.end()  # Ctrl-C: question and answer no longer match
        raise error

    def _asked(self) -> str:
        """What has not been answered, in short."""
        names = [
            f"do_step from t = {arguments[0]:.9g} s" if command == "do_step" else command
            for _, command, arguments in self._unanswered
            if command not in _HARMLESS
        ]
        few = names[-_NAMED:]
        before = f"{len(names) - len(few)} calls and " if len(names) > len(few) else ""
        return before + ", ".join(few) if few else self._unanswered[-1][1]


class _LastWords:
    """The end of what a process prints."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self._text = b""
        self._process = process
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as pipe:
            while piece := os.read(pipe.fileno(), 4096):
                self._text = (self._text + piece)[-_LAST_WORDS:]

    def quote(self) -> str:
        """Make them the end of an error message."""
        self._thread.join(1.0)  # longer only if the FMU has started processes of its own
        text = " | ".join(self._text.decode("utf-8", errors="replace").split("\n")).strip(" |")
        return f" It printed: {text}" if text else " It printed nothing."


def _end(child: subprocess.Popen[bytes], line: socket.socket, folder: Path) -> None:
    """End a process and all that it started, and remove its folder."""
    line.close()
    with contextlib.suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(child.pid, signal.SIGKILL)
        else:
            child.kill()
    child.wait()
    shutil.rmtree(folder, ignore_errors=True)


def _how_it_ended(status: int) -> str:
    """Words for an exit status."""
    if status >= 0:
        return f"ended itself with exit status {status}"
    try:
        return f"was ended by {signal.Signals(-status).name}"
    except ValueError:
        return f"was ended by signal {-status}"
