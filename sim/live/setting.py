"""What stays the same on the page: the cameras, what they see of the ground, the graph, and the colours."""

from typing import Any

import numpy as np

from sim.assembly import Assembly
from sim.pictures.ground import field_of_view, heading
from sim.pictures.theme import COLORS, LABELS, PARTICLE

_REACH_M = 60.0  # beyond any map
_MARGIN = 0.10


def setting(assembly: Assembly, *, recorded: bool) -> dict[str, Any]:
    """The first event of every page.

    Args:
        assembly: The run.
        recorded: Whether it is a recording.
    """
    scenario, cameras = assembly.scenario, assembly.cameras
    told = {
        "type": "setting",
        "run": scenario.name,
        "preset": scenario.preset,
        "frames": scenario.frames,
        "rate_hz": scenario.rate_hz,
        "recorded": recorded,
        "unit": scenario.target.unit,
        "central": scenario.central.name if scenario.baselines.cpf else None,
        "single": scenario.baselines.single,
        "cameras": [
            {"name": name, "width_px": camera.width_px, "height_px": camera.height_px}
            for name, camera in cameras.items()
        ],
        "colors": {**COLORS, "particles": PARTICLE},
        "labels": dict(LABELS),
    }
    # a camera that tracks in its image plane knows of no ground
    return told if scenario.target.space == "image" else told | {"ground": _ground(assembly)}


def _ground(assembly: Assembly) -> dict[str, Any]:
    """The ground from above, in metres."""
    scenario, cameras = assembly.scenario, assembly.cameras
    height = (
        scenario.target.plane_height + scenario.target.height / 2
        if scenario.target.space == "plane"
        else float(assembly.start.mean[2])
    )
    known = assembly.truth if assembly.truth is not None else assembly.start.mean[None]
    points = np.concatenate([[camera.center[:2] for camera in cameras.values()], known[:, :2]])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * max(float((high - low).max()), 1.0)
    return {
        "area_m": {"low": (low - margin).round(2).tolist(), "high": (high + margin).round(2).tolist()},
        "cameras": {
            name: {
                "position_m": camera.center[:2].round(3).tolist(),
                "heading": heading(camera).round(3).tolist(),
                "view_m": field_of_view(camera, height, _REACH_M).round(2).tolist(),
            }
            for name, camera in cameras.items()
        },
        "edges": [sorted(edge) for edge in sorted(assembly.graph.edges)],
        "occluders_m": [
            each.footprint.round(2).tolist() for each in (assembly.world.occluders if assembly.world else ())
        ],
    }
