"""Colours of all figures, after Okabe and Ito, distinguishable for the colour-blind."""

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, BLACK = "#CC79A7", "#222222"
NO_CONTACT = "#D9D9D9"
EDGES = "#595959"  # of a mesh's cells
ICE = "#D6ECF8"
MELTING, SATURATED = "#E3EFF9", "#FCEBD3"  # shades of the phases of a film
