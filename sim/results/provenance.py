"""What a run leaves behind beside its figures: who sent what, and which versions it was made with."""

import platform
from importlib.metadata import version

from sim.results.results import Results, counted

KINDS = ("consensus", "pixels")
"""What nodes say to each other frame by frame."""
_PACKAGES = ("dcpf", "numpy", "opencv-python-headless", "eclipse-zenoh")


def sent_per_frame(results: Results) -> dict[str, dict[str, dict[str, float]]]:
    """What each node sent in a frame, in the mean of the frames after frame 0: messages and bytes by kind.

    One to d receivers counts d times. Nodes that died have told no total and are left out.
    """
    frames = results.scenario.frames - 1
    sent: dict[str, dict[str, dict[str, float]]] = {}
    for node, last in sorted(results.statuses.items()):
        first = results.first_statuses.get(node)
        for group in ("messages", "bytes"):
            total = counted(last, group)
            total.subtract(counted(first, group) if first else {})
            each = {kind: round(total[kind] / frames, 3) for kind in KINDS if total[kind]}
            sent.setdefault(node, {})[group] = each
    return sent


def versions() -> dict[str, str]:
    """The versions of Python and of the packages that make the numbers."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}
