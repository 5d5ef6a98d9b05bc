"""The presets: the paper's features and rules, and those that hold where these lose the target.

A preset fills what the scenario file leaves unsaid; what the file says wins.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from nodes.vision.target import TargetOptions

PresetName = Literal["paper", "robust"]

PAPER: Mapping[str, Any] = {
    "network": {"consensus": {"algorithm": "constant", "epsilon": 0.325}, "iterations": 12},
    "filter": {
        "n_particles": 500,
        "color": {"space": "rgb", "bins_per_channel": 8, "parts": [1.0], "part_weights": [1.0]},
        "sampling": {"grid": None},
        "likelihood": {"calibration": "fixed"},
    },
    "fusion": {"rule": "eq17", "local_particles": "own", "proposal": "prior"},
}
"""Jing & Chen's section 4: 8 bins a channel, ε = 0.325, 12 rounds, the SIR filter, Eq. 17 as printed.

What the paper leaves open is as in the other preset: boxes follow from the geometry, and the likelihood has a
floor (`filter.likelihood.form: literal` takes that away too).
"""

ROBUST: Mapping[str, Any] = {
    "network": {"consensus": {"algorithm": "metropolis"}, "iterations": 12},
    "filter": {
        "n_particles": 500,
        "color": {
            "space": "joint_rgb",
            "bins_per_channel": 6,
            "gain_correction": True,
            "background_weighting": True,
        },
        "sampling": {"grid": [15, 15], "kernel": "epanechnikov"},
        "likelihood": {"calibration": "background"},
        "model_update": {"alpha": 0.05},
        "min_likeness": 0.5,
    },
    "fusion": {"rule": "quadratic_fit", "local_particles": "shared", "proposal": "optimal"},
}
"""Joint colours without the camera's gain, a likelihood set from the background, whose fit is exchanged."""

ONE_CAMERA: Mapping[str, Any] = {
    "target": {"start": {"position_error": 1.0, "position_deviation": 2.0, "velocity_deviation": 30.0}},
    "filter": {"dynamics": {"position_variance": 16.0, "velocity_variance": 900.0}, "min_likeness": None},
}
"""What both presets begin with in the image plane, in pixels."""

ONE_CAMERA_PAPER: Mapping[str, Any] = {
    "filter": {"likelihood": {"form": "literal"}, "resampling": {"threshold": 1.0}},
}
"""Medeiros et al. and Truong & Kim: a Gaussian in the distance, whatever the camera sees, and resampling in
every frame."""

ONE_CAMERA_ROBUST: Mapping[str, Any] = {"fusion": {"rule": "net_information"}}
"""A camera that nobody helps stays nearer to its particles by their moments than by a quadratic."""

PAPER_ON_ARRAY: Mapping[str, Any] = {"filter": {"sampling": {"grid": [15, 15]}}}
"""What the paper preset reads of a box where the emulated array counts: a machine of fixed cycles cannot read
boxes of any size."""

LOSSY: Mapping[str, Any] = {"network": {"consensus": {"algorithm": "ratio"}}}
"""What the robust preset averages with where links lose messages."""

SMALLEST_PERSON = 0.8
"""Height in m from which a target on a plane is taken for a person."""
PERSON_PARTS: Mapping[str, Any] = {
    "filter": {
        "color": {"parts": [0.14, 0.38, 0.48], "part_weights": [0.2, 0.45, 0.35]},
        "sampling": {"grid": [10, 20], "kernel": "uniform"},
    }
}
"""Head, torso and legs: what the robust preset tells apart in a target that stands on a plane, and the
rows of samples to do so. They lie evenly: a box follows a body closely, and its border tells most of where it
is."""


def preset_defaults(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the preset that a scenario names fills in; that of the default where it names none that there is.

    Args:
        data: The scenario as its author wrote it.
    """
    name = data.get("preset", "robust")
    target = data.get("target")
    defaults = PAPER if name == "paper" else ROBUST
    if isinstance(target, Mapping) and target.get("space") == "image":
        defaults = _merged(defaults, ONE_CAMERA)
        defaults = _merged(defaults, ONE_CAMERA_PAPER if name == "paper" else ONE_CAMERA_ROBUST)
    elif name == "robust" and _is_person(target):
        defaults = _merged(defaults, PERSON_PARTS)
    if name == "paper" and _on_array(data.get("filter")):
        defaults = _merged(defaults, PAPER_ON_ARRAY)
    network = data.get("network")
    if name != "paper" and isinstance(network, Mapping) and _loses(network.get("conditions")):
        defaults = _merged(defaults, LOSSY)
    consensus = network.get("consensus") if isinstance(network, Mapping) else None
    if isinstance(consensus, Mapping) and "algorithm" in consensus:
        # Another algorithm has other options: the file's own choice stands by itself.
        defaults = {**defaults, "network": {**defaults.get("network", {}), "consensus": {}}}
    return defaults


def _on_array(filter_options: Any) -> bool:
    """Whether the emulated array counts the colours."""
    return isinstance(filter_options, Mapping) and filter_options.get("backend") == "simd"


def _loses(conditions: Any) -> bool:
    """Whether some link loses messages at random."""
    if not isinstance(conditions, Mapping):
        return False
    links = conditions.get("links")
    each = [conditions, *(links if isinstance(links, Sequence) else ())]
    return any(isinstance(link, Mapping) and bool(link.get("loss")) for link in each)


def _is_person(target: Any) -> bool:
    """Whether a target stands on a plane and is tall enough to have head, torso and legs."""
    told = target if isinstance(target, Mapping) else {}
    height = told.get("height", TargetOptions().height)
    return told.get("space") != "volume" and isinstance(height, int | float) and height >= SMALLEST_PERSON


def _merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: _merged(one.get(key, {}), other.get(key, {}))
        if isinstance(one.get(key, other.get(key)), Mapping)
        else other.get(key, one.get(key))
        for key in one.keys() | other.keys()
    }
