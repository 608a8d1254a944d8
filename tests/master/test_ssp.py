"""SSP files by hand: what is read, and what comes out."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.connections import Connection
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.ssp import open_ssp
from railcosim.master.units import BASE_UNITS, Linear, Unit, Units, conversion

from .plant import (
    LOOP,
    ROUNDING,
    STEP,
    STEPS,
    component,
    connection,
    growth,
    loop,
    make_fmu,
    real,
    run,
    values,
)
from .ssp_systems import unit_loop

MILLIMETRES = Linear(1e3)


def test_two_fmus(package):
    path = package(loop(a=values(real("x0", 2.0)), b=values(real("k", -0.5))))
    with open_ssp(path) as loaded:
        assert [fmu.name for fmu in loaded.fmus] == ["a", "b"]
        assert loaded.notes == ()
        assert (loaded.start, loaded.stop, loaded.step) == (None, None, None)
        found = run(loaded)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)
    np.testing.assert_allclose(found["b.z"], -0.5 * growth(2.0, -0.5), rtol=ROUNDING)


def test_gauss_seidel(package):
    """The integrator first: the same equations as Jacobi. The gain first changes nothing."""
    path = package(loop(a=values(real("x0", 2.0)), b=values(real("k", -0.5))))
    for first in ("a", "b"):
        with open_ssp(path) as loaded:
            found = run(loaded, gauss_seidel(first=first, degree=0))
        np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)


def test_connections_either_way_round(package):
    """Start and end do not say where values come from; the kinds of the connectors do."""
    system = LOOP.format(
        a=component("a", more=values(real("x0", 2.0)), u="input", x="output"),
        b=component("b", more=values(real("k", -0.5)), u="input", z="output"),
        forward=connection("b.u", "a.x"),
        back=connection("a.u", "b.z"),
    )
    with open_ssp(package(system)) as loaded:
        assert set(loaded.connections) == {
            Connection("a", "x", "b", "u"),
            Connection("b", "z", "a", "u"),
        }


def test_linear_transformation(package):
    inside = '<ssc:LinearTransformation factor="-0.25" offset="0.75"/>'
    path = package(loop(a=values(real("x0", 2.0)), inside=inside))
    with open_ssp(path) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): Linear(-0.25, 0.75)}
        found = run(loaded)
    # x' = 0.75 - 0.25 x = -0.25 (x - 3)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.25, offset=-3.0), rtol=ROUNDING)


def test_a_chain_with_a_transformation(package):
    """No circle: u of the first component keeps its start value, and Euler's rule does the rest."""
    inside = '<ssc:LinearTransformation factor="2" offset="1"/>'
    chain = (
        f"<ssd:Elements>{component('a', u='input', x='output')}"
        f"{component('b', u='input', x='output')}</ssd:Elements>"
        f"<ssd:Connections>{connection('a.x', 'b.u', inside)}</ssd:Connections>"
    )
    with open_ssp(package(chain)) as loaded:
        held = run(loaded)
    # a.x = t / 2 (u starts at 0.5); b.x sums h (2 t/2 + 1) over the steps before.
    t = STEP * np.arange(STEPS + 1)
    n = np.arange(STEPS + 1)
    np.testing.assert_allclose(held["a.x"], t / 2, rtol=ROUNDING)
    np.testing.assert_allclose(held["b.x"], STEP * (n + STEP * n * (n - 1) / 2), rtol=ROUNDING)


def test_units_are_converted(package, two_units):
    path = package(unit_loop(a=values(real("x0", 2000.0, "mm"))), **two_units)
    # The unit of the value is defined by nobody in this file:
    with (
        pytest.raises(ValueError, match=r"a\.x0: mm is not m, and mm is not defined"),
        open_ssp(path),
    ):
        pass
    units = (
        '<ssd:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="1e-3"/></ssc:Unit></ssd:Units>'
    )
    path = package(unit_loop(a=values(real("x0", 2000.0, "mm"))), units, **two_units)
    with open_ssp(path) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): MILLIMETRES}
        assert loaded.starts["a"] == {"x0": 2.0}
        found = run(loaded)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)


@pytest.mark.parametrize(
    ("source", "target", "pairs"),
    [
        ("degC", "degF", [(100.0, 212.0), (0.0, 32.0), (-40.0, -40.0)]),
        ("degF", "degC", [(212.0, 100.0), (-40.0, -40.0)]),
        ("degF", "K", [(32.0, 273.15)]),
        ("K", "degF", [(373.15, 212.0)]),
    ],
)
def test_units_that_do_not_begin_at_nothing(source, target, pairs):
    kelvin = tuple(int(unit == "K") for unit in BASE_UNITS)
    units = Units({
        "degC": Unit("degC", kelvin, 1.0, 273.15),
        "degF": Unit("degF", kelvin, 5 / 9, 459.67 * 5 / 9),
        "K": Unit("K", kelvin),
    })  # fmt: skip
    convert = conversion(source, units, target, units)
    for given, expected in pairs:
        assert convert(given) == pytest.approx(expected, abs=1e-10)  # rounding, of 500


def test_conversion_comes_before_the_transformation(package, two_units):
    inside = '<ssc:LinearTransformation factor="2" offset="1"/>'
    c = Connection("a", "x", "b", "u")
    with open_ssp(package(unit_loop(inside=inside), **two_units)) as loaded:
        assert loaded.maps == {c: Linear(2e3, 1.0)}
    suppressed = 'suppressUnitConversion="true"'
    with open_ssp(package(unit_loop(suppressed, inside), **two_units)) as loaded:
        assert loaded.maps == {c: Linear(2.0, 1.0)}
        run(loaded)  # m may feed mm then
    with open_ssp(package(unit_loop(suppressed), **two_units)) as loaded:
        assert loaded.maps == {}
        run(loaded)


def test_units_that_do_not_fit(package, tmp_path):
    files = {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="m"),
        "MM__fmu": make_fmu(tmp_path / "K.fmu", u="K"),
    }
    with (
        pytest.raises(ValueError, match="m and K are of different dimensions"),
        open_ssp(package(unit_loop(), **files)),
    ):
        pass


def test_offsets_of_units(package, tmp_path):
    files = {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="degC"),
        "MM__fmu": make_fmu(tmp_path / "K.fmu", u="K"),
    }
    with open_ssp(package(unit_loop(), **files)) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): Linear(1.0, 273.15)}
