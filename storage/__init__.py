"""How files are written, held and thrown away, and when Ctrl-C is obeyed; knows no railways."""
