"""Writes a run as MCAP, as it goes: for viewers in Foxglove's schemas, and word for word for a replay.

| topic | holds |
|---|---|
| `/{camera}/image`, `/{camera}/calibration`, `/tf` | pictures (JPEG), calibration, where the cameras stand |
| `/{camera}/particles`, `/{camera}/boxes/{whose}` | a thinned sample of the particles; boxes in the picture |
| `/scene`, `/log` | fields of view, graph, estimates with 2σ ellipses, truth; nodes that come and go |
| `dcpf/{run}/…` | estimates, truth and statuses as JSON, byte for byte as they were told under that key |

Times are the run's, from frame 0. The scenario as run is attached. Chunks are small and written at once: a
process that dies takes the last of them along and no more.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from network.wire import codec, keys
from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from nodes.vision.target import project_boxes
from sim.assembly import Assembly
from sim.pictures.theme import COLORS, PAPER, PARTICLE
from sim.recording import foxglove, scene
from sim.recording.schemas import ALIVE_SCHEMA, json_schema

SCENARIO = "scenario.json"
"""Of the attachment: the scenario as run, everything resolved."""
CHUNK_BYTES = 32 * 1024
"""Every picture of some size ends a chunk."""
GONE = ("lost", "left", "died", "killed", "silent", "stuck")
"""Events after which a node is not there; who has been knocked, or is refused a message, still is."""

Filmed = EstimateMessage | TruthMessage | StatusMessage | PreviewMessage


@dataclass(eq=False)
class McapFilm:
    """A recording in the making.

    Attributes:
        path: The file.
        assembly: The run.
    """

    path: Path
    assembly: Assembly
    _channels: dict[str, int] = field(default_factory=dict)
    _schemas: dict[str, int] = field(default_factory=dict)
    _now_s: float = 0.0

    def __post_init__(self) -> None:
        self._file: BinaryIO = self.path.open("wb")
        self._writer = Writer(self._file, CHUNK_BYTES, CompressionType.ZSTD)
        self._writer.start(profile="", library="dcpf")
        try:
            self._show_setting()
        except OSError:
            self._abandon()
            raise

    @property
    def _on_ground(self) -> bool:
        """Whether positions are places in the world, not in the picture of one camera."""
        return self.assembly.scenario.target.space != "image"

    def _show_setting(self) -> None:
        """What stays the same: the scenario, the cameras, the graph."""
        attached = self.assembly.scenario.model_dump_json().encode()
        self._writer.add_attachment(0, 0, SCENARIO, "application/json", attached)
        if not self._on_ground:
            return
        cameras = list(self.assembly.cameras.values())
        self._show("/tf", foxglove.transforms(cameras, 0.0), 0.0)
        for camera in cameras:
            self._show(f"/{camera.name}/calibration", foxglove.calibration(camera, 0.0), 0.0)
        self._show("/scene", scene.setting(self.assembly), 0.0)

    def add(self, message: Filmed) -> None:
        """Records what a node, or the world, has told; nothing of frames that the run does not have.

        Raises:
            OSError: The disk is full, or the like.
        """
        frame, scenario = message.frame, self.assembly.scenario
        if frame >= scenario.frames:
            return
        time_s = max(frame, 0) / scenario.rate_hz
        match message:
            case EstimateMessage():
                self._begin(time_s)
                self._tell(keys.estimate(scenario.name, message.node), message, time_s)
                self._show_estimate(message, time_s)
            case TruthMessage():
                self._tell(keys.truth(scenario.name), message, time_s)
                self._show_truth(message, time_s)
            case StatusMessage():
                self._tell(keys.status(scenario.name, message.node), message, time_s)
            case PreviewMessage():
                self._begin(time_s)
                self._show_preview(message, time_s)

    def event(self, event: str, node: str, details: dict[str, Any]) -> None:
        """Records that something happened to a node: its coming and going, and whatever else for the log."""
        gone = event in GONE
        if event in ("seen", "lost"):
            key = keys.alive(self.assembly.scenario.name, node)
            if key not in self._channels:
                self._open(key, ALIVE_SCHEMA)
            self._put(key, json.dumps({"alive": not gone}).encode(), self._now_s)
        if gone and self._on_ground:
            ids = [f"{estimator}/{node}" for estimator in ("dcpf", "cpf", "single")]
            self._show("/scene", scene.without(ids, self._now_s), self._now_s)
        words = " ".join([f"{node}: {event}", *(f"{name}={value}" for name, value in details.items())])
        self._show("/log", foxglove.log(node, words, self._now_s, warning=event != "seen"), self._now_s)

    def close(self) -> None:
        """Writes the index and closes the file."""
        if not self._file.closed:
            try:
                self._writer.finish()  # type: ignore[no-untyped-call]  # mcap has no types
                self._file.close()
            finally:
                self._abandon()

    def _abandon(self) -> None:
        """Closes the file as it is."""
        with suppress(OSError):
            self._file.close()

    def _begin(self, time_s: float) -> None:
        """A frame begins: what was told before is in the file from now on."""
        if time_s > self._now_s:
            self._now_s = time_s
            self._file.flush()

    def _show_estimate(self, message: EstimateMessage, time_s: float) -> None:
        target = self.assembly.scenario.target
        if len(message.mean) != 2 * target.n_axes:
            return
        if self._on_ground:
            self._show("/scene", scene.estimate(message, target), time_s)
        cameras = {"dcpf": [message.node], "cpf": list(self.assembly.cameras), "single": []}
        for name in cameras[message.estimator]:
            self._show_box(name, message.estimator, message, COLORS[message.estimator], time_s)

    def _show_truth(self, message: TruthMessage, time_s: float) -> None:
        if self._on_ground:
            self._show("/scene", scene.truth(message, self.assembly.scenario.target), time_s)
        for name in self.assembly.cameras:
            self._show_box(name, "truth", message, PAPER, time_s)

    def _show_box(
        self, name: str, whose: str, message: EstimateMessage | TruthMessage, shade: str, time_s: float
    ) -> None:
        target, camera = self.assembly.scenario.target, self.assembly.cameras.get(name)
        if camera is not None:
            box = project_boxes(message.mean[None, : target.n_axes], target, camera)[0]
            self._show(f"/{name}/boxes/{whose}", foxglove.box_annotation(box, shade, time_s), time_s)

    def _show_preview(self, message: PreviewMessage, time_s: float) -> None:
        target = self.assembly.scenario.target
        # the picture as it was sent, comment and all
        picture = foxglove.image(message.node, codec.encode_preview(message), time_s)
        self._show(f"/{message.node}/image", picture, time_s)
        if message.particles.shape[1] != target.n_axes:
            return
        topic = f"/{message.node}/particles"
        if self._on_ground:
            points = scene.in_world(message.particles, target)
            self._show(topic, foxglove.point_cloud(points, time_s), time_s)
        else:
            self._show(topic, foxglove.points_annotation(message.particles, PARTICLE, time_s), time_s)

    def _show(self, topic: str, message: Any, time_s: float) -> None:
        """Writes a protobuf message for viewers."""
        if topic not in self._channels:
            register = partial(register_schema, self._writer, type(message))
            name = message.DESCRIPTOR.full_name
            self._channels[topic] = self._channel(topic, name, MessageEncoding.Protobuf, register)
        self._put(topic, message.SerializeToString(), time_s)

    def _tell(self, key: str, message: EstimateMessage | TruthMessage | StatusMessage, time_s: float) -> None:
        """Writes a message of ours as it went over the network."""
        if key not in self._channels:
            self._open(key, json_schema(type(message)))
        self._put(key, codec.encode_public(message), time_s)

    def _open(self, key: str, schema: dict[str, Any]) -> None:
        name, data = schema["title"], json.dumps(schema).encode()
        register = partial(self._writer.register_schema, name, SchemaEncoding.JSONSchema, data)
        self._channels[key] = self._channel(key, name, MessageEncoding.JSON, register)

    def _channel(self, topic: str, schema: str, encoding: str, register: Callable[[], int]) -> int:
        if schema not in self._schemas:
            self._schemas[schema] = register()
        return self._writer.register_channel(topic, encoding, self._schemas[schema])

    def _put(self, topic: str, data: bytes, time_s: float) -> None:
        stamp = foxglove.to_ns(time_s)
        self._writer.add_message(self._channels[topic], stamp, data, stamp)
