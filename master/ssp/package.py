"""An unpacked SSP: its files, and careful access to its XML."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from railcosim.master.fmi.archive import FmuError, parse_xml
from railcosim.master.ssp.structure import MAIN, SSC, SSD
from railcosim.master.suggest import suggest
from railcosim.master.units import IDENTITY, Linear, Units


@dataclass(frozen=True)
class Package:
    """An unpacked SSP.

    Attributes
    ----------
    path : Path
        The ``.ssp`` file, for messages.
    folder : Path
        Where it is unpacked.
    """

    path: Path
    folder: Path

    def main(self) -> Element:
        """Root of the system structure."""
        return self.xml(self.folder / MAIN)

    def xml(self, file: Path) -> Element:
        """Root of an XML file in the package."""
        return parse_xml(f"{self.path}: {file.relative_to(self.folder)}", file.read_bytes())

    def file(self, element: Element, what: str) -> Path:
        """Find the file in the package that the attribute ``source`` of an element names.

        Raises
        ------
        FmuError
            If it is not a file in this package.
        """
        source = self.need(element, "source")
        if element.get("sourceBase", "SSD") != "SSD":
            raise self.error(f"{what}: source {source!r} is inside a component; put it beside them")
        try:
            parts = urlsplit(source)
            file = (self.folder / unquote(parts.path)).resolve()
        except (ValueError, OSError):  # not even a URI; a path too long
            raise self.error(f"{what}: source {source!r} is no path in the package") from None
        inside = file.is_relative_to(self.folder.resolve())
        if parts.scheme or parts.netloc or parts.query or parts.fragment or not inside:
            raise self.error(f"{what}: source {source!r} is not in the package; pack it in")
        if not file.is_file():
            names = [str(f.relative_to(self.folder)) for f in self.folder.rglob("*") if f.is_file()]
            raise self.error(f"{what}: no file {source!r} in the package{suggest(source, names)}")
        return self.folder / file.relative_to(self.folder.resolve())

    def need(self, element: Element, attribute: str) -> str:
        """Look up an attribute that SSP asks for."""
        value = element.get(attribute)
        if value is None:
            raise self.error(f"an element {local(element)} has no attribute {attribute}")
        return value

    def number(self, element: Element, attribute: str, default: float | None = None) -> float:
        """Read an attribute that is a number."""
        if default is not None and attribute not in element.attrib:
            return default
        text = self.need(element, attribute)
        try:
            return float(text)
        except ValueError:
            raise self.error(
                f"{local(element)}: {attribute} must be a number, got {text!r}"
            ) from None

    def linear(self, element: Element) -> Linear:
        """Read the transformation of a connection or of a mapping.

        Raises
        ------
        FmuError
            For one that is not linear.
        """
        found = [child for child in element if child.tag.endswith("Transformation")]
        if not found:
            return IDENTITY
        if found[0].tag != f"{SSC}LinearTransformation":
            raise self.error(f"a {local(found[0])} is not supported; only linear ones are")
        return Linear(self.number(found[0], "factor", 1.0), self.number(found[0], "offset", 0.0))

    def units(self, root: Element) -> Units:
        """Read the units that a file defines."""
        try:
            return Units.of(root)
        except ValueError as error:
            raise self.error(f"a unit is not defined by numbers ({error})") from None

    def error(self, text: str) -> FmuError:
        """Make an error that names the file."""
        return FmuError(f"{self.path}: {text}")


def check_structure(path: Path, text: bytes) -> None:
    """Refuse what is not SSP 1.

    Raises
    ------
    FmuError
        Saying what it is instead.
    """
    root = parse_xml(f"{path}: {MAIN}", text)
    if root.tag != f"{SSD}SystemStructureDescription":
        raise FmuError(f"{path}: {MAIN} begins with {root.tag}, which is not SSP 1.0; export it so")
    version = root.get("version", "")
    if not version.startswith("1."):
        raise FmuError(f"{path}: SSP version {version or 'not stated'}; export it as SSP 1.0")


def local(element: Element) -> str:
    """Name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def is_true(text: str | None) -> bool:
    """Read an XML Boolean; one that is missing is false."""
    return text in {"true", "1"}
