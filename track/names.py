"""Names of the tracks that need no file."""

from __future__ import annotations

from pathlib import Path

PAPER = "paper"
FOLDER = Path(__file__).parent / "built_in"
BUILT_IN = (PAPER, *sorted(path.stem for path in FOLDER.glob("*.toml")))
