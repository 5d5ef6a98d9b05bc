"""What the page is told: a run's messages as events for a browser, and all of it again for who comes later.

Sans-I/O: it is given messages, the coming and going of nodes, and the time; events are plain data. Pixels are
projected here, by the cameras' own mathematics, so that the page only draws.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from nodes.vision.target import project_boxes
from sim.assembly import Assembly
from sim.live.nodes import NodeStates
from sim.live.setting import setting
from sim.pictures.ground import ellipse
from sim.recording.scene import in_world
from sim.results.recorder import expected_tracks
from sim.results.results import Track

Event = dict[str, Any]


class Story:
    """A run as the page tells it."""

    def __init__(self, assembly: Assembly, *, recorded: bool) -> None:
        """A run of which nothing has been heard.

        Args:
            assembly: The run.
            recorded: Whether it is a recording, which can be paused and turned back.
        """
        self._assembly, scenario = assembly, assembly.scenario
        self._target, self._rate_hz, self._frames = scenario.target, scenario.rate_hz, scenario.frames
        self._tracks = expected_tracks(scenario)
        self._nodes = NodeStates({node for _, node in self._tracks})
        self._setting = setting(assembly, recorded=recorded)
        self._positions: dict[Track, dict[int, Float[np.ndarray, " A"]]] = {}
        self._truth: dict[int, Float[np.ndarray, " A"]] = {}
        self._errors: dict[Track, dict[int, float]] = {}
        self._latest: dict[Track | str, Event] = {}

    def so_far(self) -> list[Event]:
        """Everything that somebody who comes now has to be told."""
        errors = [
            {"estimator": estimator, "node": node, "errors": sorted(found.items())}
            for (estimator, node), found in sorted(self._errors.items())
        ]
        path = [[frame, *_rounded(place[:2])] for frame, place in sorted(self._truth.items())]
        history = {"type": "history", "errors": errors, "truth": path}
        return [self._setting, history, *self._nodes.events(), *self._latest.values()]

    def take(self, message: EstimateMessage | TruthMessage | StatusMessage, now_s: float) -> list[Event]:
        """A message has come: what the page is told.

        Args:
            message: The message; one that does not belong to this run's frames and nodes tells nothing.
            now_s: When, seconds of any clock.
        """
        if message.frame >= self._frames:
            return []
        match message:
            case StatusMessage():
                return self._nodes.take(message, now_s)
            case EstimateMessage():
                return self._take_estimate(message)
            case TruthMessage():
                return self._take_truth(message)

    def see(self, node: str, *, here: bool) -> list[Event]:
        """A node's token has come or gone."""
        frame = max((event["frame"] for event in self._latest.values()), default=0)
        return self._nodes.see(node, here=here, frame=frame)

    def picture(self, message: PreviewMessage) -> Event | None:
        """What the page is told about a picture; None if it is not of this run's cameras."""
        camera = self._assembly.cameras.get(message.node)
        if camera is None or message.particles.shape[1] != self._target.n_axes:
            return None
        if self._target.space == "image":
            pixels = message.particles
        else:
            pixels, _ = camera.project(in_world(message.particles, self._target))
        shown = pixels[camera.contains(pixels)]
        return {
            "type": "preview",
            "node": message.node,
            "frame": message.frame,
            "particles": np.round(shown, 1).tolist(),
        }

    def _take_estimate(self, message: EstimateMessage) -> list[Event]:
        track = (message.estimator, message.node)
        if track not in self._tracks or len(message.mean) != 2 * self._target.n_axes:
            return []
        position = message.mean[: self._target.n_axes]
        self._positions.setdefault(track, {})[message.frame] = position
        seen_by = {"dcpf": [message.node], "cpf": list(self._assembly.cameras), "single": []}
        event = {
            "type": "estimate",
            "estimator": message.estimator,
            "node": message.node,
            "frame": message.frame,
            "position": _rounded(position),
            "ellipse": [_rounded(p) for p in ellipse(message.mean[:2], message.covariance[:2, :2])[::2]],
            "lost": message.lost,
            "boxes_px": self._boxes(position, seen_by[message.estimator]),
        }
        self._latest[track] = event
        return [event, *self._new_errors(message.frame, [track])]

    def _take_truth(self, message: TruthMessage) -> list[Event]:
        if len(message.mean) != 2 * self._target.n_axes:
            return []
        position = message.mean[: self._target.n_axes]
        self._truth[message.frame] = position
        event = {
            "type": "truth",
            "frame": message.frame,
            "position": _rounded(position),
            "boxes_px": self._boxes(position, self._assembly.cameras),
        }
        self._latest["truth"] = event
        return [event, *self._new_errors(message.frame, self._positions)]

    def _new_errors(self, frame: int, tracks: Iterable[Track]) -> list[Event]:
        """The distances to the truth that are known now."""
        truth, events = self._truth.get(frame), []
        for track in tracks:
            position = self._positions.get(track, {}).get(frame)
            if truth is not None and position is not None:
                error = round(float(np.linalg.norm(position - truth)), 4)
                self._errors.setdefault(track, {})[frame] = error
                estimator, node = track
                events.append(
                    {"type": "error", "estimator": estimator, "node": node, "frame": frame, "error": error}
                )
        return events

    def _boxes(self, position: Float[np.ndarray, " A"], cameras: Iterable[str]) -> Mapping[str, list[float]]:
        """The target's box in the cameras' pictures, where it can be pictured."""
        boxes = {
            name: project_boxes(position[None], self._target, self._assembly.cameras[name])[0]
            for name in cameras
        }
        return {name: np.round(box, 1).tolist() for name, box in boxes.items() if np.isfinite(box).all()}


def _rounded(place: Float[np.ndarray, " A"]) -> list[float]:
    return np.round(place, 3).tolist()
