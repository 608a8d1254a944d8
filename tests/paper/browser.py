"""A page in headless Chromium: its document after the scripts ran, what they complained of."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
OPTIONS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-quic",
    "--virtual-time-budget=30000",
]  # fmt: skip


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    assert CHROMIUM is not None
    with TemporaryDirectory(prefix="railcosim_browser_") as profile:
        command = [CHROMIUM, *OPTIONS, f"--user-data-dir={profile}", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=1800, check=True)


def render(page: Path) -> tuple[str, list[str]]:
    """The document as rendered, and everything written to the console."""
    done = _run("--enable-logging=stderr", "--v=0", "--dump-dom", page.resolve().as_uri())
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def screenshot(page: Path, picture: Path, width: int = 1200, height: int = 2400) -> None:
    """A picture (PNG) of the top of the page."""
    size = f"--window-size={width},{height}"
    _run(size, f"--screenshot={picture.resolve()}", page.resolve().as_uri())
