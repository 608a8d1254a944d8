"""sources/buildDescription.xml: how to compile the runtime. FMI 3.0 defines it."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from .common import to_bytes


def build_description(name: str, sources: Sequence[str]) -> bytes:
    """The XML for a model identifier and the C files to be compiled, relative to ``sources/``."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(
        root,
        "BuildConfiguration",
        modelIdentifier=name,
        description="C99 and its mathematics library; FMI's own headers are needed",
    )
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for source in sources:
        SubElement(files, "SourceFile", name=source)
    return to_bytes(root)
