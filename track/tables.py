"""Tables of numbers in CSV files, as spreadsheets and measuring cars write them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from railcosim.parameters import ParameterError

LONGEST_LINE = 1000  # characters
MARK = "\xef\xbb\xbf"  # byte order, of UTF-8, as spreadsheets write it


def lines_of(path: Path, most: int) -> Iterator[tuple[int, str]]:
    """Lines that are neither empty nor a comment, with their numbers.

    Raises
    ------
    ParameterError
        If the file cannot be read, a line is too long, or there are `most` or more.
    """
    try:
        # Numbers and names are ASCII; a comment in Latin-1 does no harm.
        with path.open(encoding="latin-1") as file:
            for number in range(1, most):
                line = file.readline(LONGEST_LINE + 1)
                if len(line) > LONGEST_LINE:
                    raise ParameterError(f"{path}, line {number}: over {LONGEST_LINE} characters")
                if not line:
                    return
                line = line.removeprefix(MARK).strip("\n")
                if line.strip(' ",;\t') and not line.lstrip(' "\t').startswith("#"):
                    yield number, line
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from error
    raise ParameterError(f"{path}: over {most} lines")


def between_columns(header: str) -> str:
    """What is between the columns of a file, by its header: a semicolon, a tab or a comma."""
    return next((mark for mark in ";\t" if mark in header), ",")


def numbers_of(path: Path, number: int, line: str, between: str, count: int) -> list[float]:
    """One row of `count` numbers, which but for commas between them may have a decimal comma.

    Raises
    ------
    ParameterError
        Naming the file and the line.
    """
    cells = [bare(cell) for cell in line.split(between)]
    if between != ",":
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        row = [float(cell) for cell in cells]
    except ValueError:
        row = []
    if len(row) != count or not all(map(math.isfinite, row)) or "_" in line:
        raise ParameterError(
            f"{path}, line {number}: {count} finite numbers are wanted, there is {line[:60]!a}"
        )
    return row


def bare(cell: str) -> str:
    """Without blanks and the quotes around it."""
    cell = cell.strip()
    return cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell
