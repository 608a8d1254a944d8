"""Charts: described once, drawn on paper (matplotlib) and on screens (plotly)."""
