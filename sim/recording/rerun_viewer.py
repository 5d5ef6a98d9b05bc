"""Opens a recording in Rerun, with what Rerun does not draw by itself: the scene, and boxes in the pictures.

Rerun reads pictures, calibration, transforms, particles and the log from the file. Foxglove's SceneUpdate and
ImageAnnotations it does not know (0.41): they are logged here in Rerun's own words.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader

from sim.recording.foxglove import WORLD
from sim.recording.recovery import open_whole

TIMELINE = "message_log_time"
"""As Rerun's own importer calls the times of a recording."""
_LINE_PX = 1.0


def view(path: Path) -> None:
    """Opens a recording in a viewer, which stays."""
    stream = rr.RecordingStream("dcpf")
    stream.spawn()
    show(path, stream)
    stream.flush()


def show(path: Path, stream: rr.RecordingStream) -> None:
    """Sends a recording to a viewer, or into a file of Rerun's.

    Args:
        path: The recording; one that was cut off is shown up to there.
        stream: Where to.
    """
    with open_whole(path) as file:
        stream.log_file_from_contents(path, file.read())
        file.seek(0)
        cameras = []
        for topic, time_ns, message in _annotations(file):
            stream.set_time(TIMELINE, timestamp=np.datetime64(time_ns, "ns"))
            if isinstance(message, SceneUpdate):
                _log_scene(message, stream)
            else:
                _, camera, *_, whose = topic.split("/")
                cameras.append(camera)
                _log_annotation(camera, whose, message, stream)
    stream.send_blueprint(_layout(sorted(set(cameras))))


def _annotations(file: Any) -> Iterator[tuple[str, int, SceneUpdate | ImageAnnotations]]:
    """What Rerun does not draw by itself, with topics and times."""
    kinds: dict[str, Any] = {kind.DESCRIPTOR.full_name: kind for kind in (SceneUpdate, ImageAnnotations)}
    for schema, channel, message in make_reader(file).iter_messages():
        if schema is not None and schema.name in kinds:
            yield channel.topic, message.log_time, kinds[schema.name].FromString(message.data)


def _log_scene(update: SceneUpdate, stream: rr.RecordingStream) -> None:
    for deletion in update.deletions:
        stream.log(f"scene/{deletion.id}", rr.Clear(recursive=True))
    for entity in update.entities:
        stream.log(f"scene/{entity.id}", rr.CoordinateFrame(WORLD))
        _log_lines(entity, stream)
        balls = [(_xyz(each.pose.position), each.size.x / 2, _rgb(each.color)) for each in entity.spheres]
        if balls:
            places, radii, colors = zip(*balls, strict=True)
            stream.log(f"scene/{entity.id}", rr.Points3D(places, radii=radii, colors=colors))
        for text in entity.texts:
            stream.log(
                f"scene/{entity.id}/name",
                rr.Points3D(
                    [_xyz(text.pose.position)], labels=[text.text], radii=0.0, colors=[_rgb(text.color)]
                ),
                rr.CoordinateFrame(WORLD),
            )


def _log_lines(entity: SceneEntity, stream: rr.RecordingStream) -> None:
    strips, colors = [], []
    for line in entity.lines:
        points = [_xyz(point) for point in line.points]
        if line.type == LinePrimitive.LINE_LIST:
            pieces = [points[i : i + 2] for i in range(0, len(points), 2)]
        else:
            pieces = [[*points, points[0]]]
        strips += pieces
        colors += [_rgb(line.color)] * len(pieces)
    if strips:
        stream.log(
            f"scene/{entity.id}/lines",
            rr.LineStrips3D(strips, colors=colors, radii=rr.Radius.ui_points(_LINE_PX)),
            rr.CoordinateFrame(WORLD),
        )


def _log_annotation(
    camera: str, whose: str, annotations: ImageAnnotations, stream: rr.RecordingStream
) -> None:
    entity = f"{camera}/image/{whose}"
    if not annotations.points:
        stream.log(entity, rr.Clear(recursive=False))
        return
    (outline,) = annotations.points
    corners = np.array([[point.x, point.y] for point in outline.points])
    color = _rgb(outline.outline_color)
    drawn: Any
    if outline.type == outline.POINTS:
        drawn = rr.Points2D(corners, colors=[color], radii=rr.Radius.ui_points(outline.thickness))
    else:
        edges = [*corners.min(axis=0), *corners.max(axis=0)]
        drawn = rr.Boxes2D(array=edges, array_format=rr.Box2DFormat.XYXY, colors=[color])
    # the frame in which Rerun's importer puts a camera's pictures
    stream.log(entity, drawn, rr.CoordinateFrame(f"{camera}_image_plane"))


def _layout(cameras: list[str]) -> rrb.Blueprint:
    pictures = [rrb.Spatial2DView(origin=f"{name}/image", name=name) for name in cameras]
    world = rrb.Spatial3DView(origin="/", name="world", contents=["+ /**", "- /*/boxes/**"])
    log = rrb.TextLogView(origin="log", name="log")
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(world, log, row_shares=[4, 1]), rrb.Grid(*pictures)),
        rrb.TimePanel(timeline=TIMELINE),
        collapse_panels=True,
    )


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _rgb(color: Any) -> tuple[float, float, float, float]:
    return color.r, color.g, color.b, color.a
