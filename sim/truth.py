"""The target's true state in each frame: from the rendered world, or from measurements beside the footage."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from nodes.filtering.motion import DynamicsOptions
from nodes.imaging.camera import Camera
from nodes.vision.target import TargetOptions
from sim.footage.ground_truth import read_ground_truth
from sim.scenario.model import FootageOptions
from sim.scenario.parsing import ScenarioError
from sim.world.world import World


def rendered_truth(
    world: World,
    target: TargetOptions,
    camera: Camera,
    times: Float[np.ndarray, " T"],
    dynamics: DynamicsOptions,
) -> Float[np.ndarray, "T D"]:
    """The states of a target in a rendered world.

    Args:
        world: The world.
        target: Who or what is tracked, and in which space.
        camera: Whose pixels count, in the image plane.
        times: Of the frames, seconds, evenly spaced.
        dynamics: What a state consists of.

    Returns:
        Metres and metres a second; in the image plane pixels and pixels a second, NaN where the camera's lens
        cannot picture the target. Autoregressive dynamics have the frame before in place of the velocity.
    """
    name, part = target.subject, target.part
    interval = float(times[1] - times[0])
    # with one frame before the first, where people and objects are as well
    each = np.array([world.middle(name, part, t) for t in (float(times[0]) - interval, *times.tolist())])
    if target.space == "image":
        positions, _ = camera.project(each[:, 0])
        velocities = np.array(np.gradient(positions, interval, axis=0))
    else:
        positions, velocities = each[:, 0, : target.n_axes], each[:, 1, : target.n_axes]
    return _states(positions, velocities, dynamics)


def measured_truth(
    footage: FootageOptions,
    target: TargetOptions,
    n_frames: int,
    rate_hz: float,
    dynamics: DynamicsOptions,
) -> Float[np.ndarray, "T D"] | None:
    """The states of a target in footage, as in `rendered_truth`, or None where nobody has measured them.

    Args:
        footage: With the ground truth's file, if there is one.
        target: In which space it is tracked.
        n_frames: Of the run.
        rate_hz: Frames a second.
        dynamics: What a state consists of.

    Raises:
        ScenarioError: The ground truth is shorter than the run.
    """
    if footage.ground_truth is None:
        return None
    path = Path(footage.ground_truth)
    measured = read_ground_truth(path, target.unit)[footage.first_frame :]
    if len(measured) < n_frames:
        raise ScenarioError(
            f"{path}: has {len(measured)} frames from first_frame on, the run {n_frames}: take fewer frames"
        )
    positions = measured[:n_frames, : target.n_axes]
    if target.space == "image":
        # pixels of the video, to those of the pictures as they are used
        positions = (positions + 0.5) * footage.scale - 0.5
    # before the first frame nobody measured
    positions = np.vstack([positions[:1], positions])
    velocities = np.vstack([np.zeros(target.n_axes), np.gradient(positions[1:], 1 / rate_hz, axis=0)])
    return _states(positions, velocities, dynamics)


def _states(
    positions: Float[np.ndarray, "T1 A"], velocities: Float[np.ndarray, "T1 A"], dynamics: DynamicsOptions
) -> Float[np.ndarray, "T D"]:
    """States from positions and velocities that begin a frame earlier."""
    if dynamics.model == "autoregressive":
        return np.hstack([positions[1:], positions[:-1]])
    return np.hstack([positions, velocities])[1:]
