"""What `railcosim` says of itself, also where a terminal is narrow."""

import inspect
import subprocess
import sys
from importlib.metadata import version

import pytest

from railcosim.analysis.pair.owner import Owner
from railcosim.cli.commands import COMMANDS, loaded
from railcosim.cli.scheme_options import Inputs
from railcosim.master.names import SCHEMES
from railcosim.master.schemes.catalogue import CATALOGUE

HEAVY = {
    "numpy", "scipy", "xarray", "pandas", "h5py", "h5netcdf", "matplotlib", "plotly", "fmpy",
    "dask", "jinja2", "multiprocessing.pool",
}  # fmt: skip
LIGHT = f"""
import sys
sys.argv = ["railcosim", "--help"]
from railcosim.cli.main import run
run()
loaded = {HEAVY} & set(sys.modules)
assert not loaded, loaded
"""


def test_version(railcosim):
    assert railcosim("--version") == (0, f"railcosim {version('railcosim')}\n", "")


def test_no_command_is_help(railcosim):
    said = railcosim()
    assert said == railcosim("--help")
    assert said == railcosim("-h")
    assert said.status == 0
    assert all(name in said.out for name in COMMANDS)


HELP_OF_ALL = f"""
import sys
HEAVY = {HEAVY}
from railcosim.cli.commands import COMMANDS, loaded
for name in COMMANDS:
    loaded(name)
    heavy = HEAVY & set(sys.modules)
    assert not heavy, (name, heavy)
"""


def test_the_list_of_commands_loads_none_of_them():
    subprocess.run([sys.executable, "-c", LIGHT], check=True, capture_output=True)


def test_help_loads_nothing_that_commands_work_with():
    """It took up to 4 s of a processor, and with numpy alone 0.6 s."""
    done = subprocess.run(
        [sys.executable, "-c", HELP_OF_ALL], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_summaries_are_the_commands_own(name):
    docstring = inspect.cleandoc(loaded(name).help)
    assert COMMANDS[name].summary == docstring.splitlines()[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_names_are_whole_at_80_columns(railcosim, command):
    status, out, err = railcosim(command, "-h")
    assert (status, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    words = set(out.replace(",", " ").replace(";", " ").replace(":", " ").split())
    for option in loaded(command).params:
        if option.param_type_name == "option":
            assert set(option.opts) <= words
            if isinstance(option.default, str):  # such as the schemes that are predicted
                assert all(part in out for part in option.default.split(","))
        if "--scheme" in option.opts:
            assert {*CATALOGUE, *Inputs, *Owner} <= words


def test_what_looks_like_markup_is_shown(railcosim):
    assert "wheelset[i].rail_force_z" in railcosim("frf", "-h").out


def test_names_of_schemes_are_those_there_are():
    """They are listed apart, so that help need not load what computes."""
    assert tuple(CATALOGUE) == SCHEMES


def test_completion(railcosim, monkeypatch):
    monkeypatch.setenv("_RAILCOSIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "railcosim run --scheme interface-jacobian-c")
    monkeypatch.setenv("COMP_CWORD", "3")
    assert railcosim().out.split() == [name for name in CATALOGUE if "conserving" in name]
