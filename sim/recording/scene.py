"""A run in the viewers' three dimensions: cameras' fields of view, the graph, estimates and the truth.

Pure: values in, Foxglove's SceneUpdate out. Each thing is an entity of its own; a later one of the same name
takes its place.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from jaxtyping import Float

from network.wire.messages import EstimateMessage, TruthMessage
from nodes.vision.target import TargetOptions
from sim.assembly import Assembly
from sim.pictures.ground import ellipse, field_of_view
from sim.pictures.theme import COLORS, FAINT, MUTED, PAPER
from sim.recording.foxglove import WORLD, color, timestamp

_LINE_PX = 2.0
_REACH_M = 15.0  # how far the fields of view are drawn
_DIAMETERS_M = {"dcpf": 0.12, "cpf": 0.16, "single": 0.08, "truth": 0.10}
_NAME_M = 0.35


def setting(assembly: Assembly) -> SceneUpdate:
    """What stays: names and fields of view of the cameras, on the ground, and who talks to whom."""
    floor = 0.0 if assembly.scenario.target.space == "volume" else assembly.scenario.target.plane_height
    entities = []
    for name, camera in assembly.cameras.items():
        rim = field_of_view(camera, floor, _REACH_M)
        points = np.column_stack([rim, np.full(len(rim), floor)])
        entity = _entity(f"view/{name}", 0.0)
        entity.lines.append(_line(points, FAINT, LinePrimitive.LINE_LOOP))
        x, y, z = camera.center.tolist()
        place = Pose(position=Vector3(x=x, y=y, z=z + _NAME_M), orientation=Quaternion(w=1.0))
        entity.texts.append(
            TextPrimitive(pose=place, billboard=True, font_size=_NAME_M, color=color(FAINT), text=name)
        )
        entities.append(entity)
    graph = _entity("graph", 0.0)
    ends = [assembly.cameras[name].center for edge in sorted(assembly.graph.edges) for name in edge]
    if ends:
        graph.lines.append(_line(np.array(ends), MUTED, LinePrimitive.LINE_LIST))
    return SceneUpdate(entities=[*entities, graph])


def estimate(message: EstimateMessage, target: TargetOptions) -> SceneUpdate:
    """An estimate: a ball at the mean and the 2σ ellipse of its covariance across the ground."""
    place = in_world(message.mean[None, : target.n_axes], target)[0]
    rim = ellipse(message.mean[:2], message.covariance[:2, :2])
    entity = _entity(f"{message.estimator}/{message.node}", message.time_s)
    shade = COLORS[message.estimator]
    entity.spheres.append(_ball(place, shade, _DIAMETERS_M[message.estimator]))
    entity.lines.append(
        _line(np.column_stack([rim, np.full(len(rim), place[2])]), shade, LinePrimitive.LINE_LOOP)
    )
    return SceneUpdate(entities=[entity])


def truth(message: TruthMessage, target: TargetOptions) -> SceneUpdate:
    """The truth: a white ball, since both viewers' backgrounds are dark."""
    entity = _entity("truth", message.time_s)
    place = in_world(message.mean[None, : target.n_axes], target)[0]
    entity.spheres.append(_ball(place, PAPER, _DIAMETERS_M["truth"]))
    return SceneUpdate(entities=[entity])


def without(names: Iterable[str], time_s: float) -> SceneUpdate:
    """Takes entities away."""
    deletions = [
        SceneEntityDeletion(timestamp=timestamp(time_s), type=SceneEntityDeletion.MATCHING_ID, id=name)
        for name in names
    ]
    return SceneUpdate(deletions=deletions)


def in_world(positions: Float[np.ndarray, "N A"], target: TargetOptions) -> Float[np.ndarray, "N 3"]:
    """Positions of the target in three dimensions: those on the plane get its height."""
    if positions.shape[1] == 3:
        return positions
    return np.column_stack([positions, np.full(len(positions), target.plane_height)])


def _entity(name: str, time_s: float) -> SceneEntity:
    return SceneEntity(timestamp=timestamp(time_s), frame_id=WORLD, id=name)


def _line(points: Float[np.ndarray, "N 3"], shade: str, kind: Any) -> LinePrimitive:
    return LinePrimitive(
        type=kind,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        thickness=_LINE_PX,
        scale_invariant=True,
        points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
        color=color(shade),
    )


def _ball(place: Float[np.ndarray, " 3"], shade: str, diameter_m: float) -> SpherePrimitive:
    x, y, z = place.tolist()
    return SpherePrimitive(
        pose=Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(w=1.0)),
        size=Vector3(x=diameter_m, y=diameter_m, z=diameter_m),
        color=color(shade),
    )
