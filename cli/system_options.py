"""Commands of our pair that also take any system of FMUs from a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer

from .option_types import LawOption, SystemOption
from .options import UsageError, given_here


@dataclass(frozen=True, kw_only=True)
class SystemOptions:
    """A system of FMUs in the place of the pair."""

    system: SystemOption = None
    law: LawOption = None

    def file(
        self, context: typer.Context, of_pair: tuple[str, ...], of_system: tuple[str, ...] = ()
    ) -> Path | None:
        """The system's file, if there is one; refuses options that are of the other."""
        if self.system is not None:
            refuse_of_pair(context, self.system, of_pair)
            return self.system
        for name in ("law", *of_system):
            if given_here(context, name):
                raise UsageError(f"--{name.replace('_', '-')}: is of FMUs of --system")
        return None


def refuse_of_pair(context: typer.Context, system: Path, options: tuple[str, ...]) -> None:
    """Refuse options given on the command line that say nothing of a system in a file."""
    for name in options:
        if given_here(context, name):
            option = "--" + name.strip("_").replace("_", "-")
            raise UsageError(f"{option}: is of our pair; {system} has its own FMUs. Leave it out")
