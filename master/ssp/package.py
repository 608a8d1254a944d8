"""An unpacked SSP: its files, and careful access to its XML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from railcosim.master.fmi.archive import FmuError, parse_xml
from railcosim.master.ssp.structure import MAIN, SSC, SSD
from railcosim.master.suggest import suggest
from railcosim.master.units import IDENTITY, Linear, Table, Units


@dataclass(frozen=True)
class Package:
    """An unpacked SSP.

    Attributes
    ----------
    path : Path
        The ``.ssp`` file, for messages.
    folder : Path
        Where it is unpacked.
    name : str
        Of the file with the system structure.
    """

    path: Path
    folder: Path
    name: str = MAIN

    def main(self) -> Element:
        """Root of the system structure."""
        return self.xml(self.folder / self.name)

    def variants(self) -> dict[str, str]:
        """Files with system structures and what these are called."""
        found = sorted(file for file in self.folder.glob("*.ssd") if file.is_file())
        return {file.name: self.xml(file).get("name", file.stem) for file in found}

    def of_variant(self, name: str) -> Package:
        """The package with another system structure, by its name or that of its file.

        Raises
        ------
        FmuError
            If there is none, or it is not SSP.
        """
        known = self.variants()
        chosen = [f for f, called in known.items() if name in {called, f, f.removesuffix(".ssd")}]
        if not chosen:
            names = list(known.values())
            raise self.error(
                f"has no variant {name!r}{suggest(name, names)}; there are {', '.join(names)}"
            )
        if len(chosen) > 1:
            raise self.error(f"{name!r} is the name of {' and of '.join(chosen)}; give the file's")
        check_structure(self.path, (self.folder / chosen[0]).read_bytes())
        return replace(self, name=chosen[0])

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

    def transformation(self, element: Element) -> Linear | Table:
        """Read what becomes of a value in a connection or by a mapping.

        Raises
        ------
        FmuError
            For one that SSP does not know, or a wrong value.
        """
        found = [child for child in element if child.tag.endswith("Transformation")]
        if not found:
            return IDENTITY
        one = found[0]
        if one.tag == f"{SSC}LinearTransformation":
            return Linear(self.number(one, "factor", 1.0), self.number(one, "offset", 0.0))
        kind = local(one).removesuffix("MappingTransformation")
        if kind not in _VALUES or one.tag != f"{SSC}{kind}MappingTransformation":
            raise self.error(f"a {local(one)} is not known")
        entries = tuple(
            tuple(self._mapped(kind, self.need(entry, side)) for side in ("source", "target"))
            for entry in one.iterfind(f"{SSC}MapEntry")
        )
        return Table(kind, entries)  # type: ignore[arg-type]  # pairs

    def _mapped(self, kind: str, text: str) -> bool | int | str:
        """One end of an entry of a mapping."""
        try:
            return _VALUES[kind](text)
        except (KeyError, ValueError):
            raise self.error(f"a mapping of {kind} values has {text!r}, which is none") from None

    def units(self, root: Element) -> Units:
        """Read the units that a file defines."""
        try:
            return Units.of(root)
        except ValueError as error:
            raise self.error(f"a unit is not defined by numbers ({error})") from None

    def error(self, text: str) -> FmuError:
        """Make an error that names the file."""
        return FmuError(f"{self.path}: {text}")


_VALUES: Mapping[str, Callable[[str], bool | int | str]] = {
    "Boolean": {"true": True, "1": True, "false": False, "0": False}.__getitem__,
    "Integer": int,
    "Enumeration": str,
}
"""How values of mappings are written."""


def check_structure(path: Path, text: bytes) -> None:
    """Refuse what is not SSP 1 or 2.0.

    Raises
    ------
    FmuError
        Saying what it is instead.
    """
    root = parse_xml(f"{path}: {MAIN}", text)
    if root.tag != f"{SSD}SystemStructureDescription":
        raise FmuError(f"{path}: {MAIN} begins with {root.tag}, which is no SSP; export it so")
    version = root.get("version", "")
    if not version.startswith(("1.", "2.")):
        raise FmuError(
            f"{path}: SSP version {version or 'not stated'}; export it as SSP 1.0 or 2.0"
        )


def local(element: Element) -> str:
    """Name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def is_true(text: str | None) -> bool:
    """Read an XML Boolean; one that is missing is false."""
    return text in {"true", "1"}
