"""What a checkpoint keeps of the command that wrote it, so that `run --resume F` is enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Any, TypeAlias

import typer

from railcosim.storage.whole import write_whole

from .terminal import errors

FREE = (
    "out", "plot", "time", "limit", "checkpoint", "every", "resume", "isolate", "believe", "fresh",
)  # fmt: skip
"""Parameters that may differ when a run is resumed: they do not decide its numbers."""
Kept: TypeAlias = Path | tuple[Path, ...]
BY_CONTENT = ("system", "law", "vehicle_fmu", "track_fmu")
"""Files that may be in another folder; name and content are in the run's identity."""


TOLD_BY_FMUS = ("vehicle", "vehicles", "track", "set_", "local", "then")
"""Of parameters that FMUs were made of, which are kept."""


def resumed(context: typer.Context, path: Path | None) -> Path | None:
    """Make the options in a checkpoint the defaults of the command; a callback of ``--resume``."""
    if path is not None and not context.resilient_parsing:
        from railcosim.master.checkpoint import options_of

        options = _absolute(options_of(path), path.parent)
        context.default_map = {**options, "checkpoint": str(path)}
    return path


def check_agreement(context: typer.Context, path: Path) -> None:
    """Raise CheckpointError if an option given again is another than the checkpoint's."""
    from railcosim.master.checkpoint import CheckpointError, options_of

    here, there = options_in(context), _absolute(options_of(path), path.parent)
    for name, value in here.items():
        source = context.get_parameter_source(name)
        free = name in FREE or name in BY_CONTENT or source is None or source.name != "COMMANDLINE"
        if not free and value != there.get(name):
            option = "--" + name.replace("_", "-")
            was = f"with {there[name]}" if name in there else "without it"
            raise CheckpointError(
                f"{option} {value}: the run in {path} was begun {was}; leave the option out"
            )


@contextmanager
def told_how_to_resume(context: typer.Context, checkpoint: Path | None) -> Iterator[None]:
    """A run that can be interrupted, and what is then said."""
    try:
        yield
    except KeyboardInterrupt:
        if checkpoint is not None and checkpoint.exists():
            command = context.info_name if context else "run"
            errors.print(
                f"railcosim {command} --resume {checkpoint} goes on from the last checkpoint"
            )
        raise


def options_in(context: typer.Context) -> dict[str, Any]:
    """The options of a command as JSON can hold them.

    Files by their whole paths; FMUs and systems beside the checkpoint by their names, so that all
    may be moved together.
    """
    values = {k: _plain(v) for k, v in context.params.items() if v not in (None, [], ())}
    for name in ("resume", *TOLD_BY_FMUS):
        values.pop(name, None)
    for name in ("irregularity", "speed"):
        text = values.get(name)
        if text is not None and Path(str(text)).is_file():
            values[name] = str(Path(text).absolute())
    beside = Path(values.get("checkpoint", "")).parent
    for name in BY_CONTENT:
        if "checkpoint" in values and name in values:
            values[name] = _each(values[name], lambda p: p.name if p.parent == beside else str(p))
    return values


def keep_fmus(checkpoint: Path | None, options: dict[str, Any], **fmus: Kept) -> list[Kept]:
    """FMUs of a run; those exported for it alone are kept beside its checkpoint, and its options.

    Exported again, they need not have the same bits, for instance on another processor.

    Parameters
    ----------
    checkpoint : Path or None
        Of the run.
    options : dict
        From `options_in`; FMUs that are not in it get there.
    **fmus : Path or tuple of Path
        By parameter of the command.

    Returns
    -------
    list of Path or tuple of Path
        Where they are now.
    """
    if checkpoint is None:
        return list(fmus.values())
    for name, given in fmus.items():
        if name not in options:
            alone = isinstance(given, Path)
            paths = (given,) if isinstance(given, Path) else given
            kept = tuple(_kept(checkpoint, path) for path in paths)
            names = [path.name for path in kept]
            options[name], fmus[name] = (names[0], kept[0]) if alone else (names, kept)
    return list(fmus.values())


def _kept(checkpoint: Path, fmu: Path) -> Path:
    kept = checkpoint.absolute().with_name(f"{checkpoint.name}.{fmu.name}")
    write_whole(kept, fmu.read_bytes())
    return kept


def _absolute(options: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Options with the paths of files that are beside the checkpoint."""
    known = [name for name in BY_CONTENT if name in options]
    return options | {n: _each(options[n], lambda p: str((folder / p).absolute())) for n in known}


def _each(paths: str | list[str], change: Callable[[Path], str]) -> str | list[str]:
    """The path of an option, or those of one that is given several times."""
    if isinstance(paths, str):
        return change(Path(paths))
    return [change(Path(path)) for path in paths]


def _plain(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Path):
        return str(value.absolute())
    return value.value if isinstance(value, Enum) else value
