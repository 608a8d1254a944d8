"""What options may be combined, and what is said if not."""

from pathlib import Path
from typing import ClassVar

import pytest

from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.choice import choice_of, maker_of
from railcosim.analysis.schemes.limits import predictable
from railcosim.cli.keeping_options import KeepingOptions
from railcosim.cli.options import UsageError, contact_parameters
from railcosim.cli.scheme_options import Inputs
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.parameters import ArgumentError


def test_scheme_and_owner_decide_each_other():
    assert choice_of(None, None) == ("gauss-seidel", Owner.TRACK)
    assert choice_of(None, Owner.MASTER) == ("interface-jacobian", Owner.MASTER)
    solved = "interface-jacobian-hermite"
    assert choice_of(solved, None) == (solved, Owner.MASTER)
    with pytest.raises(ArgumentError, match="must be master"):
        choice_of(solved, Owner.TRACK)
    without = Owner.VEHICLE, Owner.MASTER  # a track that owns no contact
    assert choice_of(None, None, without) == ("jacobi", Owner.VEHICLE)
    assert choice_of(None, None, [Owner.MASTER]) == ("interface-jacobian", Owner.MASTER)
    with pytest.raises(ArgumentError, match=r"contact track: .* it must be vehicle"):
        choice_of(None, Owner.TRACK, without)
    with pytest.raises(ArgumentError, match=r"hermite: .* it is the track's"):
        choice_of(solved, None, [Owner.TRACK])


def test_first_is_of_schemes_that_have_one():
    scheme = maker_of("gauss-seidel", None, "track")("vehicle")
    assert "track first" in scheme.describe()
    with pytest.raises(ArgumentError, match="first track: jacobi has no first"):
        maker_of("jacobi", None, "track")


def test_every_name_makes_its_scheme():
    solved = ("", "-radau-2", "-hermite", "-conserving-4", "-conserving-6")
    assert set(CATALOGUE) == {
        "jacobi", "gauss-seidel", "nepce", "picard", "aitken", "iqn-ils",
        *(f"interface-jacobian{variant}" for variant in solved),
    }  # fmt: skip
    for name, family in CATALOGUE.items():
        for degree in family.degrees:
            inputs = list(Inputs)[degree]
            assert maker_of(name, inputs)("vehicle").order >= degree + 1
    with pytest.raises(ArgumentError, match="inputs quadratic: nepce has constant inputs only"):
        maker_of("nepce", Inputs.QUADRATIC)


def test_only_what_is_linear_is_predicted():
    assert predictable(["jacobi-q", "nepce"]) == ["jacobi-quadratic", "nepce"]
    predicted = set(predictable(["jacobi", "gauss", "nepce", "picard", "interface"]))
    assert predicted == {name for name, member in members().items() if member.linear}
    with pytest.raises(ArgumentError, match="aitken cannot be predicted"):
        predictable(["jacobi", "aitken"])
    with pytest.raises(ArgumentError, match="no scheme begins with ''"):
        predictable(["jacobi", ""])


def test_what_is_kept(tmp_path):
    class Context:
        params: ClassVar = {"scheme": "jacobi", "seed": None, "plot": Path("x.png")}

    context, out = Context(), tmp_path / "x.nc"
    keeping = KeepingOptions(checkpoint=tmp_path / "c").keeping(context, out)
    assert keeping.checkpoints.every == 0.1
    assert keeping.checkpoints.options == {
        "scheme": "jacobi", "plot": str(Path("x.png").absolute()),
    }  # fmt: skip
    for arguments, message in (
        ({"every": 1.0}, "--every 1: of what"),
        ({"checkpoint": tmp_path / "c", "every": -1.0}, "--every -1: must be > 0 s"),
        ({"checkpoint": tmp_path / "x"}, "x.nc: is where --checkpoint .*x keeps its rows"),
        ({"checkpoint": tmp_path / "c", "energy": True}, "--energy"),
        ({"resume": tmp_path / "c", "energy": True}, "--energy"),
    ):
        with pytest.raises(UsageError, match=message):
            KeepingOptions(**arguments).keeping(context, out)
    with pytest.raises(UsageError, match=r"--checkpoint .*there is no folder"):
        KeepingOptions(checkpoint=tmp_path / "no" / "c").keeping(context, out)
    assert KeepingOptions(isolate=True).load == IsolatedComponent.load
    assert KeepingOptions().load == FmuComponent.load


def test_contact_stiffness():
    assert contact_parameters("hertz") == {"contact.nonlinear": True}
    assert contact_parameters("hertz:1e9") == {"contact.nonlinear": True, "contact.tangent": 1e9}
    assert contact_parameters("2e9") == {"contact.nonlinear": False, "contact.stiffness": 2e9}
    with pytest.raises(UsageError, match="must be a number from"):
        contact_parameters("hertz:-1")
