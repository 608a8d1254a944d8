"""terminalsAndIcons.xml: one terminal a wheel. FMI 3.0 defines it, FMI 2.0 FMUs may carry it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from ..interface import SIDES, WHEELSETS, Scalar, wheels
from .common import to_bytes

KIND = "_railcosim_wheel_on_rail"
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
    names = [v.name for v in table if v.causality in {"input", "output"}]
    found = {}
    for i, side in wheels():
        position = f"wheelset[{i}].position"
        here = f"wheelset[{i}].{side}"
        members = [Member("position", position)] if position in names else []
        own = [name for name in names if name.startswith(f"{here}.")]
        found[here] = members + [Member(name.removeprefix(f"{here}."), name) for name in own]
    return found


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
    for (i, side), (name, members) in zip(wheels(), terminals(table).items(), strict=True):
        terminal = SubElement(
            parent,
            "Terminal",
            name=name,
            # A bus: what only one of two FMUs has, such as irregularity_z, does not hinder.
            matchingRule="bus",
            terminalKind=KIND,
            description=f"{side} wheel of wheelset {i} on its rail",
        )
        for member in members:
            SubElement(
                terminal,
                "TerminalMemberVariable",
                variableName=member.variable,
                memberName=member.name,
                variableKind="signal",  # equal on both sides, forces too: compression is positive
            )
        _place(terminal, i, side, below=below)
    return to_bytes(root)


def _place(terminal: Element, i: int, side: str, *, below: bool) -> None:
    """Wheelset 1, the front one, is at the right; the left wheel stands behind the right one."""
    x = 75 - 50 * (i - WHEELSETS[0]) + 12 * (SIDES.index(side) - 0.5)
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
