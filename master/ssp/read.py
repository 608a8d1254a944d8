"""From SystemStructure.ssd to a flat `Structure`: systems in systems are resolved."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from railcosim.master.ssp.package import Package, is_true, local
from railcosim.master.ssp.parameters import REALS, read_bindings
from railcosim.master.ssp.structure import FMU, SSB, SSC, SSD, Hop, Start, Structure, Way, Wire
from railcosim.master.suggest import suggest
from railcosim.master.units import IDENTITY

MAX_DEPTH = 50
"""Systems within systems; nobody nests that deep by hand."""

_KINDS = {"input", "output", "parameter", "calculatedParameter"}
_GIVES = {"output", "calculatedParameter"}
_SHARED = "inout"
"""Kind of the entries of signal dictionaries: from one who gives to all who take."""
_DICTIONARY = "signals of "
"""Before the name of a dictionary, so that no element is called so."""

_Place = tuple[str, ...]
"""Names of a system or component and of those around it; empty for the outermost system."""
_Node = tuple[_Place, str]
"""A connector or a variable, and where it is."""


@dataclass(frozen=True)
class _Connector:
    kind: str
    unit: str


def read_structure(package: Package) -> Structure:
    """Read an unpacked SSP.

    Parameters
    ----------
    package : Package
        The SSP.

    Returns
    -------
    Structure
        Its components, connections and values. No FMU has been looked at yet.

    Raises
    ------
    FmuError
        For what is wrong in the file, or in SSP but not supported here.
    """
    root = package.main()
    system = root.find(f"{SSD}System")
    if system is None:
        raise package.error("has no system in it")
    reader = _Reader(package, root)
    reader.read_system(system, ())
    starts = reader.starts()
    experiment = root.find(f"{SSD}DefaultExperiment")
    return Structure(
        name=root.get("name", package.path.stem),
        fmus={_name(place): file for place, file in reader.fmus.items()},
        starts=starts,
        wires=reader.wires(),
        start=_time(package, experiment, "startTime"),
        stop=_time(package, experiment, "stopTime"),
        step=_step(package, root),
        notes=tuple(reader.notes),
    )


def _time(package: Package, experiment: Element | None, attribute: str) -> float | None:
    """One end of the default experiment; None if it is not there."""
    if experiment is None or attribute not in experiment.attrib:
        return None
    return package.number(experiment, attribute)


def _step(package: Package, root: Element) -> float | None:
    """Communication step from an annotation of libcosim or OMSimulator: SSP has no place for it."""
    for element in root.iter():
        for name, attribute in (
            ("FixedStepAlgorithm", "baseStepSize"),
            ("FixedStepMaster", "stepSize"),
        ):
            if local(element) == name and attribute in element.attrib:
                return package.number(element, attribute)
    return None


def _unit(connector: Element) -> str:
    """Unit of a connector or an entry of a dictionary; empty if not stated."""
    found = [connector.find(f"{SSC}{kind}") for kind in sorted(REALS)]
    return next((real.get("unit", "") for real in found if real is not None), "")


def _name(place: _Place) -> str:
    """A component's name in the flat system."""
    return ".".join(place)


class _Reader:
    """Gathers what is in a system and in the systems in it."""

    def __init__(self, package: Package, root: Element) -> None:
        self.package = package
        self.units = package.units(root)
        self.fmus: dict[_Place, Path] = {}
        self.notes: list[str] = []
        self._systems: dict[_Place, list[str]] = {}
        self._connectors: dict[_Node, _Connector] = {}
        self._sources: dict[_Node, tuple[_Node, Hop]] = {}
        self._starts: dict[_Node, Start] = {}
        self._dictionaries: set[_Place] = set()
        self._references: dict[_Place, _Place] = {}

    # --- reading -------------------------------------------------------------------------------

    def read_system(self, system: Element, place: _Place) -> None:
        """Read a system; its values after those of its elements, which they override."""
        if len(place) > MAX_DEPTH:
            raise self.package.error(f"systems are nested more than {MAX_DEPTH} deep; refused")
        names = self._systems[place] = []
        self._read_connectors(system, place)
        self._read_dictionaries(system, place)
        for element in system.iterfind(f"{SSD}Elements/*"):
            name = self.package.need(element, "name")
            if name in names:
                raise self.package.error(f"two elements are called {_name((*place, name))}")
            names.append(name)
            if local(element) == "System":
                self.read_system(element, (*place, name))
            elif local(element) == "Component":
                self._read_component(element, (*place, name))
            elif local(element) == "SignalDictionaryReference":
                self._refer(element, (*place, name))
            else:
                raise self.package.error(
                    f"{_name((*place, name))} is a {local(element)}, which is not known; "
                    "connect the components directly"
                )
        for element in system.iterfind(f"{SSD}Connections/{SSD}Connection"):
            self._read_connection(element, place)
        self._read_values(system, place)

    def _read_component(self, element: Element, place: _Place) -> None:
        name = _name(place)
        kind, implementation = element.get("type", FMU), element.get("implementation", "any")
        if kind != FMU:
            raise self.package.error(
                f"component {name} is of type {kind}; only FMUs ({FMU}) can be run here: "
                "put a nested system's components into this file"
            )
        if implementation not in {"any", "CoSimulation"}:
            raise self.package.error(
                f"component {name} asks for {implementation}; only CoSimulation can be run here"
            )
        self.fmus[place] = self.package.file(element, f"component {name}")
        self._read_connectors(element, place)
        self._read_values(element, place)

    def _read_connectors(self, element: Element, place: _Place) -> None:
        for connector in element.iterfind(f"{SSD}Connectors/{SSD}Connector"):
            name, kind = (self.package.need(connector, a) for a in ("name", "kind"))
            if kind not in _KINDS:
                raise self.package.error(
                    f"connector {_name((*place, name))} is of kind {kind}; "
                    f"supported are {', '.join(sorted(_KINDS))}"
                )
            self._connectors[place, name] = _Connector(kind, _unit(connector))

    def _read_dictionaries(self, system: Element, place: _Place) -> None:
        """Signal dictionaries: connectors that all references to them share."""
        for element in system.iterfind(f"{SSD}SignalDictionaries/{SSD}SignalDictionary"):
            own = (*place, _DICTIONARY + self.package.need(element, "name"))
            root: Element | None = element.find(f"{SSB}SignalDictionary")
            if element.get("source"):
                root = self.package.xml(self.package.file(element, "a SignalDictionary"))
            self._dictionaries.add(own)
            for entry in [] if root is None else root.iterfind(f"{SSB}DictionaryEntry"):
                name = self.package.need(entry, "name")
                self._connectors[own, name] = _Connector(_SHARED, _unit(entry))

    def _refer(self, element: Element, place: _Place) -> None:
        """Look a dictionary up in the system of a reference to it, and in those around it."""
        name = _DICTIONARY + self.package.need(element, "dictionary")
        around = [(*place[:n], name) for n in reversed(range(len(place)))]
        found = [one for one in around if one in self._dictionaries]
        if not found:
            raise self.package.error(
                f"{_name(place)} refers to the signal dictionary "
                f"{name.removeprefix(_DICTIONARY)!r}, which is not there"
            )
        self._references[place] = found[0]

    def _read_connection(self, element: Element, place: _Place) -> None:
        """Take note of what feeds what; start and end do not say which way values go."""
        ends = [self._end(element, place, side) for side in ("start", "end")]
        # Seen from inside a system, its own inputs give and its outputs take.
        gives = [(self._connectors[n].kind in _GIVES) != (n[0] == place) for n in ends]
        shared = [self._connectors[n].kind == _SHARED for n in ends]
        if any(shared):  # an entry of a dictionary takes from who gives, and gives to who takes
            if all(shared):
                raise self.package.error(f"{_pair(*ends)}: both are entries of dictionaries")
            gives[shared.index(True)] = not gives[shared.index(False)]
        if gives[0] == gives[1]:
            what = "give" if gives[0] else "take"
            raise self.package.error(f"{_pair(*ends)}: both {what} values; connect one of each")
        source, sink = ends if gives[0] else reversed(ends)
        if sink in self._sources:
            other = self._sources[sink][0]
            raise self.package.error(
                f"two sources for one input: {_pair(other, sink)} and {_pair(source, sink)}"
            )
        converts = not is_true(element.get("suppressUnitConversion"))
        hop = Hop(self.package.transformation(element), self._connectors[sink].unit, converts)
        self._sources[sink] = source, hop

    def _end(self, element: Element, place: _Place, side: str) -> _Node:
        name = self.package.need(element, f"{side}Connector")
        owner = element.get(f"{side}Element") or None  # OMSimulator writes "" for none
        if owner is not None and owner not in self._systems[place]:
            hint = suggest(owner, self._systems[place])
            raise self.package.error(f"a connection names the element {owner!r}, not there{hint}")
        node = (place if owner is None else (*place, owner), name)
        node = (self._references.get(node[0], node[0]), name)
        if node not in self._connectors:
            known = [n for p, n in self._connectors if p == node[0]]
            raise self.package.error(
                f"{_name(node[0]) or 'the system'} has no connector {name!r}{suggest(name, known)}"
            )
        return node

    def _read_values(self, element: Element, place: _Place) -> None:
        for bound in read_bindings(self.package, element, self.units):
            node = self._find(bound.name, place)
            full = _name((*place, bound.name))
            if node is None:
                self.notes.append(f"{full} has a value, and nothing is called so")
            else:
                self._starts[node] = bound.start

    def _find(self, name: str, place: _Place) -> _Node | None:
        """Find a variable by its name seen from a system or component."""
        if place in self.fmus or (place, name) in self._connectors:
            return place, name
        for child in self._systems[place]:
            if name.startswith(f"{child}."):
                return self._find(name.removeprefix(f"{child}."), (*place, child))
        return None

    # --- resolving -----------------------------------------------------------------------------

    def wires(self) -> tuple[Wire, ...]:
        """All connections from component to component, through the systems' connectors."""
        wires = []
        for sink in self._component_sinks():
            chain, hops = self._chain(sink)
            source = chain[-1]
            if source[0] not in self.fmus:
                continue
            if self._connectors[source].kind == "calculatedParameter":
                raise self.package.error(
                    f"{_pair(source, sink)}: calculated parameters are not passed on here; "
                    "give the value in a parameter set"
                )
            unit = self._connectors[source].unit
            way = Way(unit=unit, units=self.units, hops=hops)
            names = {"source": _name(source[0]), "target": _name(sink[0])}
            wires.append(Wire(**names, output=source[1], input=sink[1], way=way))
        return tuple(wires)

    def starts(self) -> dict[str, dict[str, Start]]:
        """Values of all components' variables, also those given to a system's connector."""
        found = {node: start for node, start in self._starts.items() if node[0] in self.fmus}
        for sink in self._component_sinks():
            chain, hops = self._chain(sink)
            # The outermost value is the strongest.
            for k, node in reversed(list(enumerate(chain[1:], start=1))):
                if node in self._starts:
                    value, way = self._starts[node].value, self._starts[node].way
                    first = Hop(IDENTITY, self._connectors[node].unit, converts=True)
                    onward = (*way.hops, first, *hops[len(hops) - k :])
                    found[sink] = Start(value, Way(unit=way.unit, units=way.units, hops=onward))
                    break
        starts: dict[str, dict[str, Start]] = {_name(place): {} for place in self.fmus}
        for (place, name), start in found.items():
            starts[_name(place)][name] = start
        return starts

    def _component_sinks(self) -> list[_Node]:
        return [node for node in self._sources if node[0] in self.fmus]

    def _chain(self, sink: _Node) -> tuple[list[_Node], tuple[Hop, ...]]:
        """The way back from a connector to what feeds it in the end; hops first to last."""
        chain: list[_Node] = [sink]
        hops: list[Hop] = []
        while chain[-1] in self._sources:
            source, hop = self._sources[chain[-1]]
            if source in chain:
                raise self.package.error(f"{_pair(source, sink)}: the connections run in a circle")
            chain.append(source)
            hops.insert(0, hop)
        return chain, tuple(hops)


def _pair(source: _Node, sink: _Node) -> str:
    """A connection for people."""
    return " -> ".join(_name((*place, name)) for place, name in (source, sink))
