"""Declared quantities: default, unit, range and source of every parameter; TOML in and out."""

from .change import changed, keys_of, value_of
from .quantity import ArgumentError, ParameterError, ParameterSet, quantity, switch, word, words
from .toml_file import doubts, from_tables, read_named, read_toml, tables_of, write_toml
from .usual import UnusualWarning, Usual

__all__ = [
    "ArgumentError",
    "ParameterError",
    "ParameterSet",
    "UnusualWarning",
    "Usual",
    "changed",
    "doubts",
    "from_tables",
    "keys_of",
    "quantity",
    "read_named",
    "read_toml",
    "switch",
    "tables_of",
    "value_of",
    "word",
    "words",
    "write_toml",
]
