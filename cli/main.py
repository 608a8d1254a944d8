"""The command `railcosim`: its commands, and what a failure looks like."""

from __future__ import annotations

import os
import sys
import warnings
from itertools import pairwise
from typing import Annotated, NoReturn

# Our matrices are small: threads wait for each other longer than they work. And how many there are
# decides in which order sums are taken, so what is exported or computed would differ in its last
# digits. To be set before numpy is loaded.
os.environ.update(
    OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", VECLIB_MAXIMUM_THREADS="1"
)

import typer
from rich.text import Text

from railcosim.storage.interruption import obey_all, reason

from .commands import MARKUP, Listed
from .terminal import console, errors

BAD_INPUT, FAILED = 2, 1
LONGEST = 2000  # characters of a message: what a stranger's file is quoted with may fill screens

app = typer.Typer(
    name="railcosim",
    cls=Listed,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=MARKUP,
    help="Railway vehicle and slab track as separate FMUs, coupled in time and in frequency. "
    "Start with `railcosim demo`.",
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version  # a tenth of the time that help takes

        console.print(f"railcosim {version('railcosim')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _begin(
    context: typer.Context,
    show_version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())


def run() -> None:
    """Entry point: exit status 0 done, 2 bad input, 1 a run that failed; never a traceback."""
    warnings.showwarning = _note
    obey_all()
    _check_arguments(sys.argv[1:])
    try:
        stopped = app(standalone_mode=False)
        if stopped:  # typer turns Ctrl-C into a number
            _fail(reason(), FAILED)
    except MemoryError as error:
        _fail(f"out of memory: ask for less at once ({error})", FAILED)
    except typer.Exit as stop:
        sys.exit(stop.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        _fail(reason(), FAILED)
    except Exception as error:
        usage = getattr(error, "format_message", None)  # click's own errors: a wrong option
        if usage is not None:
            _fail(_one_line(usage()), BAD_INPUT)
        # Here, since it loads what only commands need.
        from .failures import BAD_INPUTS, FAILURES, sentence_of

        if isinstance(error, BAD_INPUTS):
            _fail(_one_line(sentence_of(error)), BAD_INPUT)
        if isinstance(error, FAILURES):
            _fail(str(error), FAILED)
        raise


def _check_arguments(arguments: list[str]) -> None:
    """Refuse an empty one, such as of a variable that is not set: a path would be this folder."""
    for before, argument in pairwise(["railcosim", *arguments]):
        if not argument:
            _fail(f"the argument behind {before} is empty", BAD_INPUT)


def _note(message: Warning | str, category: type[Warning], *where: object, **more: object) -> None:
    """Show a warning as a line for users: which line of ours gave it is of no use to them."""
    from .failures import ONCE

    if category in ONCE:
        warnings.simplefilter("ignore", category)
    errors.print(f"note: {message}")


def _one_line(sentence: str) -> str:
    line = " ".join(sentence.split())
    half = LONGEST // 2
    return line if len(line) <= LONGEST else f"{line[:half]} ... {line[-half:]}"


def _fail(sentence: str, exit_status: int) -> NoReturn:
    errors.print(Text("error:", style="red"), sentence)
    sys.exit(exit_status)
