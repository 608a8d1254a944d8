"""Which exceptions are the user's mistakes, and which a run that failed.

Loaded when something has gone wrong: it knows modules of all kinds.
"""

from __future__ import annotations

from railcosim.compiling.platforms import UnknownPlatform
from railcosim.fmus.native_runtime.compile import CacheRefused, CompilationFailed, CompilerMissing
from railcosim.master.checkpoint import CheckpointError
from railcosim.master.component import ComponentError, RunEnded
from railcosim.master.connections import CouplingError
from railcosim.master.cosimulation import Divergence
from railcosim.master.fmi.archive import FmuError
from railcosim.master.memory import TooLargeError
from railcosim.parameters import ArgumentError, ParameterError
from railcosim.track.decay import RingWarning

from .options import UsageError

BAD_INPUTS = (
    ParameterError, FmuError, CouplingError, CheckpointError, TooLargeError, UnknownPlatform,
    UsageError,
)  # fmt: skip
FAILURES = (
    Divergence, ComponentError, RunEnded, CompilationFailed, CompilerMissing, CacheRefused,
    ArithmeticError, OSError,
)  # fmt: skip


# Parameters and the FMUs made from them say the same of a ring, in other words.
ONCE = (RingWarning,)


def sentence_of(error: Exception) -> str:
    """What is said of it: an argument of a function is an option here."""
    return error.option if isinstance(error, ArgumentError) else str(error)
