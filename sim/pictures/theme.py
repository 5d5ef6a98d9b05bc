"""The look of all pictures: which colour means what, on screen and on paper.

The colours are Okabe and Ito's (2008), told apart by people of every colour vision.
"""

from types import MappingProxyType

COLORS = MappingProxyType({"dcpf": "#D55E00", "cpf": "#0072B2", "single": "#CC79A7", "truth": "#000000"})
"""Colour of each estimator, and of the truth."""

LABELS = MappingProxyType({"dcpf": "DCPF", "cpf": "CPF", "single": "single cameras", "truth": "truth"})
"""What legends call them."""

PARTICLE = "#E69F00"
"""Particles."""
INK = "#1F1F1F"
"""Text and axes."""
MUTED = "#6E6E6E"
"""Text and lines of second rank."""
FAINT = "#DDDDDD"
"""Grids, and what frames a picture."""
PAPER = "#FFFFFF"
"""The background."""
SEEN = ("#FFFFFF", "#F3F1EA", "#E9E5D8", "#DFD9C7", "#D5CDB6")
"""The ground that nobody sees, that one camera sees, that two do, three, four and more."""
