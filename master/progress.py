"""How long work tells how far it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

Progress: TypeAlias = Callable[[float, float], None]
"""Told what is done and the total, now and then; may raise to stop the work."""


def unheard(done: float, total: float) -> None:
    """Nobody listens."""
