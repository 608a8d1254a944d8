"""One number of the paper beside ours."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.plots.page import Row


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A row of the table.

    Attributes
    ----------
    figure : str
        Where the paper says it: a figure's number, or "text".
    quantity : str
        What it is.
    paper, ours : float or str
        A number, or words where the paper prints none.
    unit : str
        Of both; "1" for a ratio.
    note : str
        A reason, or how it was found.
    agrees : bool or None
        None where the paper gives nothing to hold it against.
    spatial : float or str or None
        Ours from the model in space; None where it was not asked, or says nothing of it.
    """

    figure: str
    quantity: str
    paper: float | str
    ours: float | str
    unit: str
    note: str = ""
    agrees: bool | None = None
    spatial: float | str | None = None

    @property
    def row(self) -> Row:
        """On a page."""
        return Row(
            place=self.figure, quantity=self.quantity, first=self.paper, second=self.ours,
            unit=self.unit, note=self.note, agrees=self.agrees, third=self.spatial,
        )  # fmt: skip

    @property
    def relative_difference(self) -> float | None:
        """(ours - paper) / paper, of two numbers."""
        return self.row.relative_difference

    @property
    def change_in_space(self) -> float | None:
        """(spatial - ours) / ours, of two numbers."""
        return self.row.change
