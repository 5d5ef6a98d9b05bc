"""Foxglove's schemas: a camera, its picture, its particles and a line of the log as protobuf messages.

Pure: values in, messages out. Frames of reference are `world` (metres, z up) and each camera's name (x right,
y down, z forward); times are the run's, from frame 0.
"""

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point2_pb2 import Point2
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from jaxtyping import Float

from nodes.imaging.camera import Camera
from sim.world.colors import bgr

WORLD = "world"
_LINE_PX = 2.0


def to_ns(time_s: float) -> int:
    """A time of the run as MCAP counts it, nanoseconds."""
    return round(1e9 * time_s)


def timestamp(time_s: float) -> Timestamp:
    """A time of the run."""
    stamp = Timestamp()
    stamp.FromNanoseconds(to_ns(time_s))
    return stamp


def color(shade: str, alpha: float = 1.0) -> Color:
    """A colour such as `#D55E00`."""
    blue, green, red = (bgr(shade) / 255).tolist()
    return Color(r=red, g=green, b=blue, a=alpha)


def rotation(R: Float[np.ndarray, "3 3"]) -> Quaternion:
    """The unit quaternion of a rotation matrix."""
    # q = (sin(θ/2) a, cos(θ/2)), with θ a the axis-angle vector of Rodrigues
    vector = cv2.Rodrigues(R)[0].ravel()
    half = 0.5 * float(np.linalg.norm(vector))
    x, y, z = (0.5 * np.sinc(half / np.pi) * vector).tolist()
    return Quaternion(x=x, y=y, z=z, w=float(np.cos(half)))


def camera_transform(camera: Camera, time_s: float) -> FrameTransform:
    """Where a camera stands and how it is turned: x_world = Rᵀ x_camera + centre."""
    x, y, z = camera.center.tolist()
    return FrameTransform(
        timestamp=timestamp(time_s),
        parent_frame_id=WORLD,
        child_frame_id=camera.name,
        translation=Vector3(x=x, y=y, z=z),
        rotation=rotation(camera.R.T),
    )


def transforms(cameras: list[Camera], time_s: float) -> FrameTransforms:
    """Where all cameras stand."""
    return FrameTransforms(transforms=[camera_transform(camera, time_s) for camera in cameras])


def calibration(camera: Camera, time_s: float) -> CameraCalibration:
    """Intrinsics and distortion, OpenCV's five coefficients."""
    return CameraCalibration(
        timestamp=timestamp(time_s),
        frame_id=camera.name,
        width=camera.width_px,
        height=camera.height_px,
        distortion_model="plumb_bob",
        D=camera.distortion.tolist(),
        K=camera.K.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack([camera.K, np.zeros((3, 1))]).ravel().tolist(),
    )


def image(camera: str, jpeg: bytes, time_s: float) -> CompressedImage:
    """A camera's picture."""
    return CompressedImage(timestamp=timestamp(time_s), frame_id=camera, data=jpeg, format="jpeg")


def point_cloud(points: Float[np.ndarray, "N 3"], time_s: float) -> PointCloud:
    """Points of the world, metres."""
    fields = [
        PackedElementField(name=axis, offset=4 * i, type=PackedElementField.FLOAT32)
        for i, axis in enumerate("xyz")
    ]
    return PointCloud(
        timestamp=timestamp(time_s),
        frame_id=WORLD,
        pose=Pose(position=Vector3(), orientation=Quaternion(w=1.0)),
        point_stride=12,
        fields=fields,
        data=points.astype("<f4").tobytes(),
    )


def box_annotation(box: Float[np.ndarray, " 4"], shade: str, time_s: float) -> ImageAnnotations:
    """A box in a picture: left, top, right, bottom in pixels, edges at whole numbers; NaN for none."""
    annotations = ImageAnnotations()
    if np.isfinite(box).all():
        # pixel centres at whole numbers, as images have them
        left, top, right, bottom = (box - 0.5).tolist()
        corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
        annotations.points.append(
            PointsAnnotation(
                timestamp=timestamp(time_s),
                type=PointsAnnotation.LINE_LOOP,
                points=[Point2(x=x, y=y) for x, y in corners],
                outline_color=color(shade),
                thickness=_LINE_PX,
            )
        )
    return annotations


def points_annotation(points: Float[np.ndarray, "N 2"], shade: str, time_s: float) -> ImageAnnotations:
    """Points in a picture, pixels, centres at whole numbers."""
    dots = PointsAnnotation(
        timestamp=timestamp(time_s),
        type=PointsAnnotation.POINTS,
        points=[Point2(x=x, y=y) for x, y in points.tolist()],
        outline_color=color(shade),
        fill_color=color(shade),
        thickness=_LINE_PX,
    )
    return ImageAnnotations(points=[dots])


def log(node: str, words: str, time_s: float, *, warning: bool) -> Log:
    """A line of the log."""
    level = Log.WARNING if warning else Log.INFO
    return Log(timestamp=timestamp(time_s), level=level, name=node, message=words)
