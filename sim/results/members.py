"""Who took part in a run, frame by frame, as the cameras themselves have told it in their estimates."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from network.wire.messages import EstimateMessage, StatusMessage

Told = Mapping[int, EstimateMessage]
"""A camera's estimates by frame."""


def membership(
    tracks: Mapping[str, Told], cameras: Sequence[str], frames: int, statuses: Mapping[str, StatusMessage]
) -> dict[str, Any]:
    """Members per frame, and when cameras were lost, came back, or no longer looked where they should.

    Args:
        tracks: The joint estimates of each camera.
        cameras: All cameras.
        frames: Of the run.
        statuses: The last status of each node.

    Returns:
        `per_frame`: by camera, how many it counted in each frame, None where it told nothing; `events`: a
        camera is `lost` where no other that tells counts it any more, and `back` where all do again;
        `knocked` in the first of the `frames` in which it looked elsewhere than in the beginning.
    """
    per_frame = {
        name: [len(told[frame].members) if frame in told else None for frame in range(frames)]
        for name, told in sorted(tracks.items())
    }
    events: list[dict[str, Any]] = []
    for camera in cameras:
        knocked = statuses[camera].counters.get("knocked") if camera in statuses else None
        # a status comes over the network: what is in it need not be ours
        if isinstance(knocked, Mapping) and knocked.keys() >= {"first", "frames"}:
            events.append(
                {"frame": knocked["first"], "event": "knocked", "node": camera, "frames": knocked["frames"]}
            )
        there = True
        for frame in range(frames):
            counts = [camera in told[frame].members for told in _others(tracks, camera) if frame in told]
            if counts and there and not any(counts):
                events.append({"frame": frame, "event": "lost", "node": camera})
                there = False
            elif counts and not there and all(counts):
                events.append({"frame": frame, "event": "back", "node": camera})
                there = True
    return {"per_frame": per_frame, "events": sorted(events, key=lambda each: (each["frame"], each["node"]))}


def disagreements(tracks: Mapping[str, Told], frames: int, n_axes: int) -> list[float | None]:
    """The mean distance between two cameras' estimates in each frame, None where fewer than two told one.

    Args:
        tracks: The joint estimates of each camera.
        frames: Of the run.
        n_axes: Axes of the position.
    """
    found: list[float | None] = []
    for frame in range(frames):
        told = [track[frame].mean[:n_axes] for track in tracks.values() if frame in track]
        if len(told) < 2:
            found.append(None)
            continue
        positions = np.array(told)
        i, j = np.triu_indices(len(positions), k=1)
        found.append(float(np.linalg.norm(positions[i] - positions[j], axis=1).mean()))
    return found


def _others(tracks: Mapping[str, Told], camera: str) -> list[Told]:
    return [told for name, told in tracks.items() if name != camera]
