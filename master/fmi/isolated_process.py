"""The process in which one FMU runs by itself; started by `IsolatedComponent`.

    python -m railcosim.master.fmi.isolated_process SOCKET NAME FILE FOLDER

Messages come as lists of ``(is_question, command, arguments)``. Only questions are answered. What
goes wrong in a command is the answer to the next question; until then nothing more is done.
"""

from __future__ import annotations

import json
import os
import pickle
import select
import shutil
import socket
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from railcosim.master.component import ComponentError, Hold
from railcosim.master.fmi.channel import ERRORS, FAILED, SUCCEEDED, Channel
from railcosim.master.fmi.description import read_description
from railcosim.master.fmi.fmu import FmuComponent, FmuState

_CALLS = frozenset(
    [
        "set_parameters",
        "enter_initialization",
        "exit_initialization",
        "keep_past",
        "do_step",
        "close",
    ]
)  # as they are


class _Server:
    """Commands to one FMU. Each takes plain values, and gives bytes if it is a question."""

    def __init__(self, fmu: FmuComponent) -> None:
        self._fmu = fmu
        self._states: dict[int, FmuState] = {}

    def do(self, command: str, arguments: tuple[Any, ...]) -> bytes:
        """Obey one command."""
        if command in _CALLS:
            getattr(self._fmu, command)(*arguments)
            return b""
        method: Callable[..., bytes | None] = getattr(self, command)
        return method(*arguments) or b""

    def ready(self) -> None:
        """Nothing: the answer says that the FMU is there."""

    def write_inputs(self, u: bytes) -> None:
        self._fmu.set_inputs(np.frombuffer(u))

    def read_outputs(self) -> bytes:
        self._fmu.read_outputs()
        return self._fmu.y.tobytes()

    def set_input_derivatives(self, derivatives: bytes) -> None:
        n = self._fmu.u.size
        self._fmu.set_input_derivatives(np.frombuffer(derivatives).reshape(-1, n))

    def step_derivative(self) -> bytes:
        matrix = self._fmu.step_derivative()
        assert matrix is not None  # asked only of those who declare it
        return matrix.T.tobytes()

    def output_rates(self) -> bytes:
        rates = self._fmu.output_rates()
        assert rates is not None  # likewise
        return rates.tobytes()

    def get_text(self, name: str) -> bytes:
        return self._fmu.get_text(name)

    def set_text(self, name: str, text: bytes) -> None:
        self._fmu.set_text(name, text)

    def set_hold(self, hold: int) -> None:
        self._fmu.set_hold(Hold(hold))

    def save_state(self, key: int) -> None:
        self._states[key] = self._fmu.save_state()

    def restore_state(self, key: int) -> None:
        self._fmu.restore_state(self._states[key])

    def drop_state(self, key: int) -> None:
        self._states.pop(key, None)  # never made, if saving failed

    def serialize_state(self, key: int) -> bytes:
        return self._fmu.serialize_state(self._states[key])

    def deserialize_state(self, key: int, data: bytes) -> None:
        self._states[key] = self._fmu.deserialize_state(data)

    def messages(self) -> bytes:
        return json.dumps(self._fmu.messages).encode()

    def warned(self) -> bytes:
        return json.dumps(self._fmu.warned).encode()

    def rollback_fault(self, step: float | None) -> bytes:
        if step is not None:
            self._fmu.expect_step(step)
        return json.dumps(self._fmu.rollback_fault).encode()


def serve(line: Channel, load: Callable[[], FmuComponent]) -> None:
    """Load an FMU and obey until it is closed."""
    failure: Exception | None = None
    try:
        server = _Server(load())
    except Exception as error:
        failure = error
    while True:
        # Pickled by our own parent process; answers, which an FMU could forge, never are.
        for is_question, command, arguments in pickle.loads(line.receive()):
            answer = b""
            if failure is None:
                try:
                    answer = server.do(command, arguments)
                except Exception as error:
                    failure = error
            if is_question and failure is not None:
                line.send(FAILED + _describe(failure))
                failure = None
            elif is_question:
                line.send(SUCCEEDED + answer)
            if command == "close":
                return


def _describe(error: Exception) -> bytes:
    """Kind and text of an error, for the other side to raise."""
    kind = next((name for name, kind in ERRORS.items() if isinstance(error, kind)), "")
    text = str(error) if kind else f"{type(error).__name__}: {error}"
    return json.dumps([kind or ComponentError.__name__, text]).encode()


def _end_with(line: socket.socket, folder: Path) -> None:
    """Wait until the other side of the line is gone, and go too, whatever the FMU is doing."""
    other_side = select.poll()
    other_side.register(line, 0)  # a hang-up is always told
    other_side.poll()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


def main() -> None:
    """Serve; see the module."""
    number, name, file, folder = sys.argv[1:]
    line = socket.socket(fileno=int(number))
    threading.Thread(target=_end_with, args=(line, Path(folder)), daemon=True).start()

    def load() -> FmuComponent:
        return FmuComponent(name, read_description(Path(file), Path(folder)), Path(folder))

    serve(Channel(line), load)


if __name__ == "__main__":
    main()
