"""The one way to the screen: words as they are, whatever they are made of."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text


class Terminal(Console):
    """A console for words that come from anywhere.

    File names, keys and variables hold ``[`` and ``:100:``, and a stranger's may hold what moves
    the cursor or renames the window: nothing in a string is markup, and what cannot be printed is
    shown as Python spells it. A sentence is one line, however narrow the terminal.
    """

    def __init__(self, *, stderr: bool = False, width: int | None = None) -> None:
        super().__init__(stderr=stderr, width=width, markup=False, emoji=False, highlight=False)

    def render_str(self, text: str, **more: Any) -> Text:
        """Every string passes here, alone or in a table."""
        return super().render_str(printable(text), **more)

    def print(self, *objects: Any, **more: Any) -> None:
        """Print as rich does, strings without line breaks of its own."""
        more.setdefault("soft_wrap", all(isinstance(thing, str | Text) for thing in objects))
        super().print(*objects, **more)


def printable(text: str) -> str:
    """The text with all characters escaped that are none to be seen, but line breaks.

    Control characters, those that turn the direction of writing, and halves of file names that
    are no UTF-8.
    """
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode("ascii")
        for c in text
    )


console = Terminal()
errors = Terminal(stderr=True)
