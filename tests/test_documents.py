"""The Python of the documents runs, and prints what they say it prints."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

from railcosim.analysis.pair.kept_fmus import fmus_of_pair
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
SAID = re.compile(
    r"^ *(?:print\(.*)?\)  # (.*)$", re.MULTILINE
)  # a long call ends in a line of its own
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
CODE = [
    (page, code)
    for page in PAGES
    for code in BLOCK.findall(page.read_text())
    if "print(" in code  # without, it is a part of something
]


@pytest.fixture(scope="module")
def fmus():
    """The files that the documents call ``fmus/*.fmu``, made once on a machine."""
    with fmus_of_pair(Vehicle(), Track()) as made:
        yield {name: path.read_bytes() for name, path in made.files.items()}


# Runs and linearises the FMUs of the whole track: that is what readers copy.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "code"), CODE, ids=[f"{page.name}-{k}" for k, (page, _) in enumerate(CODE)]
)
def test_python(page, code, fmus, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fmus").mkdir()
    for name, content in fmus.items():
        (tmp_path / "fmus" / f"{name}.fmu").write_bytes(content)
    exec(compile(code, str(page), "exec"), {"__name__": "__main__"})
    said = SAID.findall(code)
    assert len(said) == code.count("print(")
    assert capsys.readouterr().out.splitlines() == said


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text()):
        assert (page.parent / target).exists(), target


def test_the_first_page_has_the_two_commands_and_is_short():
    """CI takes the two from it, and runs them."""
    lines = (ROOT / "README.md").read_text().splitlines()
    fenced = [b for a, b in pairwise(lines) if a == "```sh"]
    assert len(fenced) == 2
    assert all(line.startswith("python3 -m venv .venv && .venv/bin/pip install") for line in fenced)
    assert len(lines) <= 100
