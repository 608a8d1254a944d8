"""The package `railcosim`: few names, each loaded when it is used, and found wherever one is."""

import ast
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

import railcosim

ROOT = Path(__file__).parents[2]
HEAVY = "{'numpy', 'scipy', 'xarray', 'matplotlib', 'fmpy', 'dask'}"
LIGHT = f"import sys, railcosim; dir(railcosim); print({HEAVY} & set(sys.modules) or 'nothing')"


def python(code, folder):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize("name", railcosim.__all__)
def test_every_name_is_there(name):
    assert getattr(railcosim, name) is not None
    assert name in dir(railcosim)


def test_what_type_checkers_are_told_is_what_there_is():
    tree = ast.parse(Path(railcosim.__file__).read_text())
    told = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in told.body if isinstance(node, ast.ImportFrom)]
    names = {a.asname or a.name: (node.module, a.name) for node in imports for a in node.names}
    for name in set(names) & set(railcosim.__all__):
        module, its_name = names[name]
        found = getattr(railcosim, name)
        assert found is getattr(sys.modules[module], its_name)


def test_version():
    assert railcosim.__version__ == version("railcosim")


def test_no_other_name():
    with pytest.raises(AttributeError, match="no attribute 'vehikel'"):
        _ = railcosim.vehikel


def test_importing_it_loads_nothing_heavy(tmp_path):
    assert python(LIGHT, tmp_path) == "nothing"


@pytest.mark.parametrize("folder", [ROOT, ROOT.parent, ROOT / "examples"])
def test_a_script_in_a_checkout_or_beside_it_meets_the_installed_package(folder, tmp_path):
    where = "import railcosim; print(railcosim.__file__)"
    assert python(where, folder) == python(where, tmp_path)


def test_every_folder_of_modules_is_installed():
    """In a checkout all is found; an installation has what pyproject.toml names."""
    root = Path(__file__).parents[2]
    told = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]
    folders = {place for name, place in told["package-dir"].items() if name in told["packages"]}
    tops = {Path(place).parts[0] for place in folders}
    modules = {
        path.parent.relative_to(root).as_posix() for t in tops for path in (root / t).rglob("*.py")
    }
    assert modules <= folders
