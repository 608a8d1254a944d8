"""Formal flaws of model descriptions: told once, and refused where a value would be wrong."""

from __future__ import annotations

import warnings

import pytest

from railcosim.master.fmi.description import describe_file
from railcosim.master.fmi.flaws import FlawWarning
from railcosim.master.fmi.fmu import FmuComponent, FmuError

from .anybody import description, make_fmu

FLAWS = {
    "unit": ("<Real start=", '<Real unit="furlong" start='),
    "display unit": ("<Real start=", '<Real unit="furlong" displayUnit="mile" start='),
    "variability": (' variability="discrete"', ""),  # of an Integer
    "start": (
        'causality="output"><Real ',
        'causality="output" initial="calculated"><Real start="1" ',
    ),
    "schema": ("<CoSimulation ", '<CoSimulation mood="good" '),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_told_once_and_run(tmp_path, flaw):
    text = description(variables="u x n").replace(*FLAWS[flaw])
    path = make_fmu(tmp_path / f"{flaw}.fmu", text=text)
    with pytest.warns(FlawWarning, match=f"{flaw}.fmu: its model description has formal flaws: "):
        describe_file(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", FlawWarning)
        with FmuComponent.load(path) as fmu:
            fmu.enter_initialization(0.0)
            fmu.exit_initialization()
            fmu.do_step(0.0, 1.0)
            assert fmu.get_outputs().tolist() == [0.5]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('guid="plain"', ""), "it has no guid"),
        (('modelIdentifier="anybody"', ""), "it has no modelIdentifier"),
        (('name="x"', 'name="u"'), "several variables are called 'u'"),
        (('valueReference="1"', ""), "valueReference|int"),
        (('start="0.5"', ""), "the input u has no start value"),
        (('<Unknown index="2"', '<Unknown index="20"'), "not valid FMI 2.0"),
        (("<Real ", '<Real declaredType="nobody" '), "not valid FMI 2.0"),
        (('start="0.5"', 'start="0,5"'), "start of u is '0,5', which is no number"),
        (('start="0.5"', 'start="1" nominal="0,1"'), "nominal of u is '0,1', which is no number"),
        (
            ("<ModelVariables>", '<DefaultExperiment stepSize="0,01"/><ModelVariables>'),
            "stepSize of the default experiment is '0,01'",
        ),
        (("<ModelVariables>", '<DefaultExperiment tolerance="x"/><ModelVariables>'), "tolerance"),
    ],
)
def test_refused_where_a_value_would_be_a_guess(tmp_path, change, words):
    path = make_fmu(tmp_path / "A.fmu", text=description(variables="u x").replace(*change, 1))
    with pytest.raises(FmuError, match=words):
        describe_file(path)


def test_an_integer_that_is_none(tmp_path):
    text = description(variables="n twice", n=('start="3"', 'start="2.5"'))
    path = make_fmu(tmp_path / "A.fmu", text=text)
    with pytest.raises(FmuError, match=r"start of n is '2\.5', which is no whole number"):
        describe_file(path)


def test_many_flaws_are_not_all_told(tmp_path):
    text = description().replace("<Real ", '<Real unit="furlong" ')
    path = make_fmu(tmp_path / "many.fmu", text=text)
    with pytest.warns(FlawWarning, match=r"furlong.*furlong.*furlong.*; and \d more$") as caught:
        describe_file(path)
    assert len(str(caught[0].message)) < 500
