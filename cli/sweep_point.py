"""One point of a sweep: a command, called in whatever process, and what it writes."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from .commands import loaded
from .options import UsageError

if TYPE_CHECKING:
    import xarray as xr

SWITCH = {"true": 1, "false": 0}
"""How often a switch of a command is given."""
BLANK = re.compile(r"\{(\w+)\}")


def options_of(name: str) -> dict[str, Any]:
    """The options of a command, by their names without hyphens."""
    return {
        option.removeprefix("--"): parameter
        for parameter in loaded(name).params
        for option in parameter.opts
    }


def blanks_in(arguments: Sequence[str]) -> dict[str, set[str]]:
    """Names in braces, such as ``{depth}``, and the options (without hyphens) that have them."""
    blanks: dict[str, set[str]] = {}
    option = ""
    for one in arguments:
        if one.startswith("--"):
            option = one.partition("=")[0].removeprefix("--")
        for name in BLANK.findall(one):
            blanks.setdefault(name, set()).add(option)
    return blanks


def filled(command: str, arguments: Sequence[str], values: Mapping[str, object]) -> list[str]:
    """Arguments of a command with values: in braces, as its options, or of vehicle and track."""
    known, blanks, given = options_of(command), blanks_in(arguments), list(arguments)
    for key, value in values.items():
        text = value if isinstance(value, str) else f"{value:.17g}"
        if key in blanks:
            given = [one.replace(f"{{{key}}}", text) for one in given]
        elif key not in known:
            given += ["--set", f"{key}={text}"]
        elif not known[key].is_flag:
            given += [f"--{key}", text]
        elif text not in SWITCH:
            raise UsageError(f"--set {key}={text}: --{key} is a switch; must be true or false")
        else:
            given += [f"--{key}"] * SWITCH[text]
    return given


def measured(
    command: str,
    arguments: Sequence[str],
    files: Mapping[str, bytes],
    kept: bool,
    **values: object,
) -> xr.Dataset:
    """Call a command and read what it writes.

    Parameters
    ----------
    command : str
        Its name.
    arguments : sequence of str
        The same at all points.
    files : mapping
        Content of files among the arguments, for a machine that has not got them.
    kept : bool
        Whether FMUs of ours are: where points have them in common.
    **values : float or str
        What is different here, by option or key.
    """
    from railcosim.analysis.pair.kept_fmus import none_kept
    from railcosim.master.files import load
    from railcosim.storage.temporary import scratch

    from . import results

    with TemporaryDirectory(dir=scratch()) as folder, nullcontext() if kept else none_kept():
        out, brought = Path(folder, "result.nc"), Path(folder, "brought")
        for k, (name, content) in enumerate(files.items()):
            place = brought / str(k) / Path(name).name
            place.parent.mkdir(parents=True)
            place.write_bytes(content)
            arguments = [
                f"{one.removesuffix(name)}{place}" if f"={one}".endswith(f"={name}") else one
                for one in arguments
            ]
        whole = [*filled(command, arguments, values), "--out", str(out)]
        with (
            warnings.catch_warnings(),
            redirect_stdout(io.StringIO()),
            redirect_stderr(io.StringIO()),
        ):
            warnings.simplefilter("ignore")
            try:
                loaded(command).main(whole, prog_name=command, standalone_mode=False)
            finally:
                results._claimed.close()
        return load(out)
