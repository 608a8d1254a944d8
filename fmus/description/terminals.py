"""terminalsAndIcons.xml: one terminal a wheel. FMI 3.0 defines it, FMI 2.0 FMUs may carry it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from railcosim.mechanics.ports import SIDES, Port

from ..interface import Scalar
from ..roles import Role
from .common import to_bytes

KIND, SENSOR = "_railcosim_wheel_on_rail", "_railcosim_sensor"
ICON, WHEEL = "icon", "wheel"  # names of pictures
EXTENT = 100  # of the coordinate system, from its centre
SIZE = 8  # of a terminal's icon


@dataclass(frozen=True)
class Member:
    """A variable in a terminal."""

    name: str
    variable: str


def terminals(table: Sequence[Scalar]) -> dict[str, list[Member]]:
    """Terminals by name: of each wheel its own variables, and where its wheelset is.

    Members of vehicle and track are named alike, so that two terminals of one name fit together.
    """
    places = {v.index + 1: v for v in table if v.role in (Role.IN_POSITION, Role.OUT_POSITION)}
    found: dict[str, list[Member]] = {}
    for port in sorted({v.port for v in table if v.port is not None}, key=_order):
        members = found.setdefault(port.wheel, [])
        if not members and port.wheelset in places:
            members.append(Member("position", places[port.wheelset].name))
        members += [Member(v.quantity, v.name) for v in table if v.port == port]
    return found


def sensors(table: Sequence[Scalar]) -> dict[str, list[Member]]:
    """Terminals of sensors by name."""
    found: dict[str, list[Member]] = {}
    for v in table:
        if v.terminal:
            found.setdefault(v.terminal, []).append(Member(v.quantity, v.name))
    return found


def _order(port: Port) -> tuple[int, int, str]:
    """Left wheels first, each from the front."""
    return SIDES.index(port.side), port.wheelset, port.direction.name


def terminals_and_icons(table: Sequence[Scalar], *, below: bool) -> bytes:
    """The XML.

    Parameters
    ----------
    table : sequence of Scalar
        The interface.
    below : bool
        Whether the terminals are at the lower edge of the icon (a vehicle's) or at the upper one.
    """
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = SubElement(root, "GraphicalRepresentation")
    square = {"x1": str(-EXTENT), "y1": str(-EXTENT), "x2": str(EXTENT), "y2": str(EXTENT)}
    SubElement(graphics, "CoordinateSystem", square, suggestedScalingFactorTo_mm="0.1")
    SubElement(graphics, "Icon", square)
    parent = SubElement(root, "Terminals")
    wheels = {v.port.wheel: v.port for v in table if v.port is not None}
    count = max((port.wheelset for port in wheels.values()), default=1)
    for name, members in terminals(table).items():
        i, side = wheels[name].wheelset, wheels[name].side
        terminal = SubElement(
            parent,
            "Terminal",
            name=name,
            # A bus: what only one of two FMUs has, such as irregularity_z, does not hinder.
            matchingRule="bus",
            terminalKind=KIND,
            description=f"{side} wheel of wheelset {i} on its rail",
        )
        _list(terminal, members)
        _place(terminal, i, side, count, below=below)
    about = {v.terminal: v.description.partition(":")[0] for v in table}
    for name, members in sensors(table).items():
        terminal = SubElement(
            parent, "Terminal", name=name, matchingRule="bus", terminalKind=SENSOR,
            description=about[name],
        )  # fmt: skip
        _list(terminal, members)
    return to_bytes(root)


def _list(terminal: Element, members: Sequence[Member]) -> None:
    for member in members:
        SubElement(
            terminal,
            "TerminalMemberVariable",
            variableName=member.variable,
            memberName=member.name,
            variableKind="signal",  # equal on both sides, forces too: compression is positive
        )


def _place(terminal: Element, i: int, side: str, count: int, *, below: bool) -> None:
    """Wheelset 1, the front one, is at the right; the left wheel stands behind the right one."""
    apart = 2 * EXTENT / count
    x = EXTENT - apart * (i - 0.5) + min(12, 0.24 * apart) * (SIDES.index(side) - 0.5)
    y = -EXTENT if below else EXTENT
    SubElement(
        terminal,
        "TerminalGraphicalRepresentation",
        x1=str(x - SIZE / 2),
        y1=str(y - SIZE / 2),
        x2=str(x + SIZE / 2),
        y2=str(y + SIZE / 2),
        iconBaseName=WHEEL,
        defaultConnectionColor="70 70 70",
        defaultConnectionStrokeSize="1",
    )
