"""The human figure: a mesh of elliptic tubes, posed by heading and gait.

A tube's sides are strips over one or two of its sections, so that a body is drawn in a moment: a strip ends
where the colour changes or the surface turns, and at the knee.

All lengths are fractions of the stature. Head, torso and legs take 14 %, 38 % and 48 % of the height: the
chin is at 0.86, the hem at 0.48.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from sim.world.mesh import Solids
from sim.world.people import Pose

# Rings of the tubes: height, half width, half depth, and how far the centre lies forwards; and the numbers of
# the rings, the joints, from one of which to the next the strips lead.
_HEAD = (
    (0.845, 0.030, 0.034, 0.000), (0.878, 0.034, 0.044, 0.006), (0.912, 0.045, 0.055, 0.009),
    (0.950, 0.047, 0.056, 0.005), (0.982, 0.035, 0.043, 0.002), (1.000, 0.010, 0.012, 0.000),
)  # fmt: skip
_TORSO = (
    (0.475, 0.090, 0.064, 0.000), (0.600, 0.084, 0.059, 0.001), (0.805, 0.106, 0.060, 0.001),
    (0.840, 0.076, 0.046, 0.000), (0.860, 0.034, 0.034, 0.000),
)  # fmt: skip
_ARM = (
    (0.435, 0.012, 0.018, 0.020), (0.485, 0.018, 0.022, 0.013), (0.800, 0.028, 0.033, 0.000),
    (0.828, 0.012, 0.018, 0.000),
)  # fmt: skip
_LEG = (
    (0.000, 0.028, 0.064, 0.028), (0.036, 0.029, 0.044, 0.010), (0.270, 0.039, 0.043, 0.000),
    (0.485, 0.046, 0.056, 0.000),
)  # fmt: skip
_HEAD_JOINTS, _TORSO_JOINTS, _ARM_JOINTS, _LEG_JOINTS = (0, 1, 3, 5), (0, 2, 4), (0, 1, 3), (0, 1, 2, 3)
_HEAD_FACES = 6 * (len(_HEAD_JOINTS) - 1)  # the first of a body's
HEAD_MIDDLE = (_HEAD[0][0] + _HEAD[-1][0]) / 2
"""Height of the middle of the head as a fraction of the person's."""
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
    faces: Int[np.ndarray, "F 6"]
    normals: Float[np.ndarray, "F 3"]
    paint: Int[np.ndarray, " F"]
    tone: Float[np.ndarray, " F"]


def _tube(
    rings: tuple[tuple[float, float, float, float], ...],
    joints: tuple[int, ...],
    n_sides: int,
    sideways: float,
) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "F 6"]]:
    """Vertices and faces of a tube."""
    height, half_width, half_depth, forwards = np.array(rings).T[..., None]
    angles = 2 * np.pi * (np.arange(n_sides) + 0.5) / n_sides  # from right to forwards
    widening = np.pi / n_sides / np.sin(np.pi / n_sides)  # as wide on average as the ellipses
    x = sideways + widening * half_width * np.cos(angles)
    y = forwards + widening * half_depth * np.sin(angles)
    vertices = np.stack([x, y, np.broadcast_to(height, x.shape)], axis=-1).reshape(-1, 3)
    # three rings to each strip, the last repeated if need be: up along one edge, down along the other
    upwards = np.array([np.minimum(low + np.arange(3), high) for low, high in pairwise(joints)])
    number = np.arange(len(vertices)).reshape(-1, n_sides)
    after = np.roll(number, -1, axis=1)
    faces = np.concatenate([number[upwards], after[upwards[:, ::-1]]], axis=1)
    return vertices, np.moveaxis(faces, 1, 2).reshape(-1, 6)


def _build() -> _Body:
    """Joins the tubes, and says how each moves."""
    tubes = [
        _tube(_HEAD, _HEAD_JOINTS, 6, 0.0), _tube(_TORSO, _TORSO_JOINTS, 6, 0.0),
        _tube(_ARM, _ARM_JOINTS, 4, 0.112), _tube(_ARM, _ARM_JOINTS, 4, -0.112),
        _tube(_LEG, _LEG_JOINTS, 4, 0.047), _tube(_LEG, _LEG_JOINTS, 4, -0.047),
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
    normals = np.cross(corners[:, 5] - corners[:, 2], corners[:, 3] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    paint = _paint(corners[..., 2].mean(axis=1), normals[:, 1], tube[faces[:, 0]])
    folds = 1 + 0.03 * np.sin(2.4 * np.arange(len(faces)) ** 1.5)
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


def figures(poses: Sequence[Pose], palettes: Sequence[Float[np.ndarray, "5 3"]]) -> Solids:
    """The bodies of people.

    Args:
        poses: Where and how each of them stands; at least one.
        palettes: Their colours of skin, hair, upper body, trousers and shoes; blue, green, red, 0 to 255.
    """
    numbers = [(pose.phase, pose.effort, pose.height, pose.stature) for pose in poses]
    phase, effort, height, stature = np.array(numbers).T[..., None]
    places = np.array([(*pose.position.tolist(), 0.0) for pose in poses])
    axes = np.array([_axes(pose.heading) for pose in poses])
    # a leg swings with sin(phase), and is in the air while it swings forwards
    air = effort * np.maximum(_BODY.leg * np.cos(phase), 0.0)
    bend = _STRIDE_BEND * air + _CROUCH_BEND * (1 - height / stature)
    bodies = np.empty((len(poses), *_BODY.rest.shape))
    bodies[..., 0] = stature * _BODY.rest[:, 0]
    bodies[..., 1] = stature * (_BODY.rest[:, 1] + effort * np.sin(phase) * _BODY.swing + bend * _BODY.bend)
    bodies[..., 2] = height * (_BODY.rest[:, 2] + air * _BODY.rise)
    vertices = bodies @ axes + places[:, None]
    normals = _BODY.normals @ axes
    colors = np.array(palettes)[:, _BODY.paint] * _BODY.tone[:, None]
    return Solids(vertices, _BODY.faces, normals, colors)


def heads(bodies: Solids) -> Solids:
    """The heads of some bodies."""
    part = np.s_[:, :_HEAD_FACES]
    return Solids(bodies.vertices, bodies.faces[:_HEAD_FACES], bodies.normals[part], bodies.colors[part])


def _axes(heading: float) -> list[list[float]]:
    """A body's right, forwards and up in the world."""
    cos, sin = math.cos(heading), math.sin(heading)
    return [[sin, -cos, 0.0], [cos, sin, 0.0], [0.0, 0.0, 1.0]]
