"""Pairs that a process of a study has opened, and takes back to rest for every run."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.master.system import System
from railcosim.storage.temporary import scratch
from railcosim.track.decay import RingWarning

Fmus = Mapping[str, bytes]
"""Content of FMU files, by name such as ``TrackWithContact``."""
KEPT = 6
"""Pairs that a process keeps open: of three owners, for two contacts."""


class PairsAtRest:
    """Pairs that a process has opened, taken back to rest for every run.

    To load a track of 6000 states takes ten times as long as a short run.
    """

    def __init__(self) -> None:
        self._kept: dict[Any, tuple[System, Any]] = {}
        self._stack = ExitStack()

    def system(
        self, journey: Journey, parameters: Mapping[str, float | bool], fmus: Fmus
    ) -> System:
        """A pair at rest."""
        key = pickle.dumps((journey, dict(parameters))), *fmus.items()
        if key not in self._kept:
            if len(self._kept) == KEPT:
                self.forget()
            cars, rails = self._stack.enter_context(files_of_content(fmus))
            pair = open_pair(cars, rails, dict(parameters), journey)
            with told_before():
                system = self._stack.enter_context(pair).system
            system.keep_past()
            self._kept[key] = system, system.save_state()
        system, state = self._kept[key]
        system.restore_state(state)
        return system

    def forget(self) -> None:
        """Close all of them."""
        self._kept.clear()
        self._stack.close()


AT_REST = PairsAtRest()
"""Those of this process."""


@contextmanager
def told_before() -> Iterator[None]:
    """Whoever exported the FMUs was told of a ring that is too short; workers do not repeat it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RingWarning)
        yield


@contextmanager
def files_of_content(fmus: Fmus) -> Iterator[tuple[Path, ...]]:
    """FMUs as files for as long as the block lasts: a worker may share no disk with anybody."""
    with TemporaryDirectory(dir=scratch()) as folder:
        paths = [Path(folder, f"{name}.fmu") for name in fmus]
        for path, content in zip(paths, fmus.values(), strict=True):
            path.write_bytes(content)
        yield tuple(paths)
