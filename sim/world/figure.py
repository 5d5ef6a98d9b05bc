"""The human figure: a mesh of elliptic tubes, posed by heading and gait.

All lengths are fractions of the stature. Head, torso and legs take 14 %, 38 % and 48 % of the height: the
chin is at 0.86, the hem at 0.48.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from sim.world.mesh import Mesh
from sim.world.people import Pose

# Rings of the tubes: height, half width, half depth, and how far the centre lies forwards.
_HEAD = (
    (0.845, 0.030, 0.034, 0.000), (0.878, 0.034, 0.044, 0.006), (0.912, 0.045, 0.055, 0.009),
    (0.950, 0.047, 0.056, 0.005), (0.982, 0.035, 0.043, 0.002), (1.000, 0.010, 0.012, 0.000),
)  # fmt: skip
_TORSO = (
    (0.475, 0.090, 0.064, 0.000), (0.600, 0.084, 0.059, 0.001), (0.710, 0.097, 0.067, 0.003),
    (0.805, 0.106, 0.060, 0.001), (0.840, 0.076, 0.046, 0.000), (0.860, 0.034, 0.034, 0.000),
)  # fmt: skip
_ARM = (
    (0.435, 0.012, 0.018, 0.020), (0.485, 0.018, 0.022, 0.013), (0.640, 0.025, 0.027, -0.006),
    (0.800, 0.028, 0.033, 0.000), (0.828, 0.012, 0.018, 0.000),
)  # fmt: skip
_LEG = (
    (0.000, 0.028, 0.064, 0.028), (0.036, 0.029, 0.044, 0.010), (0.270, 0.039, 0.043, 0.000),
    (0.390, 0.047, 0.053, 0.000), (0.485, 0.046, 0.056, 0.000),
)  # fmt: skip
_SHOULDER, _HIP, _WRIST, _KNEE, _ANKLE = 0.82, 0.485, 0.48, 0.27, 0.036
_STEP = 0.19  # a foot swings this far forwards and back
_REACH = 0.09  # and a hand this far
_LIFT = 0.05  # a foot rises this far when it swings forwards
_STRIDE_BEND = 0.07  # and its knee comes this far forwards
_CROUCH_BEND = 0.45  # knees come this far forwards for every unit of height lost
_SKIN, _HAIR, _UPPER, _LOWER, _SHOE = range(5)


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """A body that stands upright at the origin; axes are right, forwards, up.

    Attributes:
        rest: Where every vertex is.
        swing: How far forwards it goes with the sine of the gait's phase.
        leg: 1 on the right leg, -1 on the left leg, 0 elsewhere.
        rise: How far it rises when its foot is in the air.
        bend: How much it follows its knee, 0 to 1.
        faces: Corners of every face, clockwise from outside.
        normals: Outward unit vectors of the faces.
        paint: Which colour of the palette every face has.
        tone: How bright every face's cloth is.
    """

    rest: Float[np.ndarray, "V 3"]
    swing: Float[np.ndarray, " V"]
    leg: Float[np.ndarray, " V"]
    rise: Float[np.ndarray, " V"]
    bend: Float[np.ndarray, " V"]
    faces: Int[np.ndarray, "F 4"]
    normals: Float[np.ndarray, "F 3"]
    paint: Int[np.ndarray, " F"]
    tone: Float[np.ndarray, " F"]


def _tube(
    rings: tuple[tuple[float, float, float, float], ...], n_sides: int, sideways: float
) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "F 4"]]:
    """Vertices and faces of a tube."""
    height, half_width, half_depth, forwards = np.array(rings).T[..., None]
    angles = 2 * np.pi * (np.arange(n_sides) + 0.5) / n_sides  # from right to forwards
    x, y = sideways + half_width * np.cos(angles), forwards + half_depth * np.sin(angles)
    number = np.arange(height.size * n_sides).reshape(-1, n_sides)
    after = np.roll(number, -1, axis=1)
    faces = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1)
    return np.stack([x, y, np.broadcast_to(height, x.shape)], axis=-1).reshape(-1, 3), faces.reshape(-1, 4)


def _build() -> _Body:
    """Joins the tubes, and says how each moves."""
    tubes = [
        _tube(_HEAD, 6, 0.0), _tube(_TORSO, 8, 0.0),
        _tube(_ARM, 5, 0.112), _tube(_ARM, 5, -0.112), _tube(_LEG, 5, 0.047), _tube(_LEG, 5, -0.047),
    ]  # fmt: skip
    rest = np.concatenate([vertices for vertices, _ in tubes])
    counts = [len(vertices) for vertices, _ in tubes]
    tube = np.repeat(np.arange(len(tubes)), counts)
    starts = np.cumsum([0, *counts[:-1]])
    faces = np.concatenate([start + corners for start, (_, corners) in zip(starts, tubes, strict=True)])
    # a leg swings about the hip, an arm about the shoulder and against the leg of its side
    height = rest[:, 2]
    arm, leg = np.array([0, 0, 1, -1, 0, 0])[tube], np.array([0, 0, 0, 0, 1, -1])[tube]
    below_hip, below_shoulder = (np.maximum(1 - height / joint, 0) for joint in (_HIP, _SHOULDER))
    above_knee = np.abs(height - _KNEE)
    corners = rest[faces]
    normals = np.cross(corners[:, 3] - corners[:, 1], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    paint = _paint(corners[..., 2].mean(axis=1), normals[:, 1], tube[faces[:, 0]])
    folds = 1 + 0.05 * np.sin(2.4 * np.arange(len(faces)) ** 1.5)
    return _Body(
        rest=rest,
        swing=leg * _STEP * below_hip - arm * 2 * _REACH * below_shoulder,
        leg=leg.astype(float),
        rise=_LIFT * np.abs(leg) * np.maximum(1 - height / _KNEE, 0),
        bend=np.abs(leg) * np.maximum(1 - above_knee / 0.22, 0),
        faces=faces,
        normals=normals,
        paint=paint,
        tone=np.where((paint == _UPPER) | (paint == _LOWER), folds, 1.0),
    )


def _paint(
    height: Float[np.ndarray, " F"], forwards: Float[np.ndarray, " F"], tube: Int[np.ndarray, " F"]
) -> Int[np.ndarray, " F"]:
    """Which colour of the palette faces have, by their height, direction and tube."""
    hair = (height > 0.96) | ((height > 0.885) & (forwards < 0.3))
    head = np.where(hair, _HAIR, _SKIN)
    arm = np.where(height < _WRIST, _SKIN, _UPPER)
    leg = np.where(height < _ANKLE, _SHOE, _LOWER)
    return np.select([tube == 0, tube == 1, tube < 4], [head, np.full_like(head, _UPPER), arm], leg)


_BODY = _build()


def figure(pose: Pose, palette: Float[np.ndarray, "5 3"]) -> Mesh:
    """The body of a person.

    Args:
        pose: Where and how they stand.
        palette: Colours of skin, hair, upper body, trousers and shoes; blue, green, red, 0 to 255.
    """
    forwards = (np.cos(pose.heading), np.sin(pose.heading))
    axes = np.array([[forwards[1], -forwards[0], 0.0], [*forwards, 0.0], [0.0, 0.0, 1.0]])
    # a leg swings with sin(phase), and is in the air while it swings forwards
    air = pose.effort * np.maximum(_BODY.leg * np.cos(pose.phase), 0.0)
    bend = _STRIDE_BEND * air + _CROUCH_BEND * (1 - pose.height / pose.stature)
    body = _BODY.rest.copy()
    body[:, 1] += _BODY.swing * (pose.effort * np.sin(pose.phase)) + _BODY.bend * bend
    body[:, 2] += _BODY.rise * air
    vertices = body * (pose.stature, pose.stature, pose.height) @ axes
    vertices[:, :2] += pose.position
    colors = palette[_BODY.paint] * _BODY.tone[:, None]
    return Mesh(vertices, _BODY.faces, _BODY.normals @ axes, colors)
