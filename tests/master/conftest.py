"""FMUs and SSP files for the tests of SSP."""

from __future__ import annotations

import pytest

from .plant import make_fmu, pack, ssd


@pytest.fixture(scope="session")
def plant(tmp_path_factory):
    return make_fmu(tmp_path_factory.mktemp("plant") / "P.fmu")


@pytest.fixture
def package(tmp_path, plant):
    """Makes an SSP of a system's content, with P.fmu and more in its resources."""

    def make(system, after="", **files):
        return pack(tmp_path / "by hand.ssp", ssd(system, after), **({"P__fmu": plant} | files))

    return make


@pytest.fixture
def two_units(tmp_path):
    """An FMU whose x is in m, and one whose u is in mm."""
    return {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="m", x0="m"),
        "MM__fmu": make_fmu(tmp_path / "MM.fmu", u="mm"),
    }
