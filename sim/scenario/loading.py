"""From a scenario file to a scenario with everything resolved: presets, overrides, calibrations, footage."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from nodes.imaging.calibration import (
    CalibrationError,
    checked_camera,
    cropped,
    read_opencv,
    read_qualisys,
    scaled,
)
from nodes.imaging.camera import Camera, look_at
from nodes.imaging.sources import SourceError, VideoSource
from sim.footage import FootageError, locate
from sim.scenario.cameras import CameraOptions
from sim.scenario.complaints import validate
from sim.scenario.document import Document, merge_defaults, read_document
from sim.scenario.edges import with_edges
from sim.scenario.model import Scenario
from sim.scenario.parsing import ScenarioError
from sim.scenario.presets import preset_defaults
from sim.world.background import require_inside


def load_scenario(
    path: Path, overrides: Iterable[tuple[str, str]] = (), *, rendered: bool = True
) -> Scenario:
    """Reads a scenario file and resolves it.

    Args:
        path: The file.
        overrides: Dotted keys and values, as `--set` gives them; later ones win.
        rendered: Whether its cameras will take pictures of its room, and so must hang in it.

    Returns:
        A scenario that does not depend on the presets, on the file's place or on other files' contents: its
        cameras carry their matrices, its videos their hashes.

    Raises:
        ScenarioError: The file, or one that it names, is not as it must be.
    """
    return resolve(read_document(path), overrides, rendered=rendered)


def resolve(
    document: Document, overrides: Iterable[tuple[str, str]] = (), *, rendered: bool = True
) -> Scenario:
    """Resolves a scenario that has been read, as `load_scenario` does.

    Raises:
        ScenarioError: It, or a file that it names, is not as it must be.
    """
    path = document.path
    for key, value in overrides:
        document = document.with_value(key, value)
    document = merge_defaults(document, preset_defaults(document.data))
    scenario = validate(document, Scenario)
    try:
        resolved = _resolve(scenario, path.parent, rendered=rendered)
        return with_edges(resolved, cameras_of(resolved), path.parent)
    except (CalibrationError, FootageError, SourceError) as error:
        raise ScenarioError(f"{path}: {error}") from None
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from error


def cameras_of(scenario: Scenario) -> dict[str, Camera]:
    """The calibrated cameras of a resolved scenario, in its order, for pictures of the size that is used."""
    scale = scenario.footage.scale if scenario.footage else 1.0
    return {options.name: scaled(_matrices(options), scale) for options in scenario.cameras}


def video_source(scenario: Scenario, camera: str) -> VideoSource:
    """The pictures of a camera of a resolved scenario with footage.

    Raises:
        SourceError: The video cannot be read.
        ValueError: The scenario has a rendered world.
    """
    if scenario.footage is None:
        raise ValueError(f"scenario {scenario.name} has no footage")
    (options,) = (each for each in scenario.cameras if each.name == camera)
    return VideoSource(Path(str(options.video)), scenario.footage.scale, scenario.footage.first_frame)


def _resolve(scenario: Scenario, folder: Path, *, rendered: bool) -> Scenario:
    footage = scenario.footage
    if footage is None:
        cameras = {each.name: _calibrated(each, folder, {}) for each in scenario.cameras}
        if scenario.world is not None and rendered:
            for camera in cameras.values():
                require_inside(camera, scenario.world.room)
        return scenario.model_copy(update={"cameras": tuple(map(_as_options, cameras.values()))})
    place = locate(footage.name) if footage.name else (folder / str(footage.folder)).resolve()
    listed = read_qualisys(place / footage.calibration) if footage.calibration else {}
    resolved = []
    for options in scenario.cameras:
        video = place / _video(options)
        digest = _digest(video, options)
        size_px = VideoSource(video).size_px
        if scenario.target.space == "image" and _is_uncalibrated(options, listed):
            camera = _nominal(options.name, size_px)
        else:
            # A video may be narrower than its calibration: cropped on the right, the intrinsics hold.
            camera = cropped(_calibrated(options, folder, listed), *size_px)
        resolved.append(_as_options(camera).model_copy(update={"video": str(video), "video_sha256": digest}))
    truth = footage.ground_truth and str((folder / footage.ground_truth).resolve())
    known = footage.model_copy(update={"calibration": None, "ground_truth": truth})
    return scenario.model_copy(update={"cameras": tuple(resolved), "footage": known})


def _is_uncalibrated(options: CameraOptions, listed: Mapping[str, Camera]) -> bool:
    own = options.calibration or options.position or options.K
    return own is None and options.name not in listed


def _nominal(name: str, size_px: tuple[int, int]) -> Camera:
    """A camera of these pictures whose place nobody needs to know: the target is tracked in its pixels."""
    width, height = size_px
    K = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    return Camera(name, width, height, K, np.eye(3), np.zeros(3), np.zeros(5))


def _calibrated(options: CameraOptions, folder: Path, listed: Mapping[str, Camera]) -> Camera:
    if options.calibration is not None:
        file = folder / options.calibration
        if not file.name.endswith(".qca.txt"):
            return read_opencv(file, options.name)
        listed = read_qualisys(file)
    if options.position is None and options.K is None:
        if options.name not in listed:
            known = f", or one of the names {', '.join(listed)}" if listed else ""
            raise CalibrationError(
                f"camera {options.name} is not calibrated: give it position, look_at and focal_px, or K, R, t"
                f", or calibration{known}"
            )
        return listed[options.name]
    return _matrices(options)


def _matrices(options: CameraOptions) -> Camera:
    size = options.size_px or (0, 0)
    distortion = np.array(options.distortion)
    if options.position is not None:
        position, target = np.array(options.position), np.array(options.look_at)
        return look_at(options.name, position, target, float(options.focal_px or 0), size, distortion)
    K, R, t = np.array(options.K), np.array(options.R), np.array(options.t)
    return checked_camera(
        f"camera {options.name}", options.name, [float(n) for n in size], K, R, t, options.distortion
    )


def _as_options(camera: Camera) -> CameraOptions:
    return CameraOptions.model_validate(
        {
            "name": camera.name,
            "size_px": (camera.width_px, camera.height_px),
            "K": camera.K.tolist(),
            "R": camera.R.tolist(),
            "t": camera.t.tolist(),
            "distortion": camera.distortion.tolist(),
        }
    )


def _video(options: CameraOptions) -> str:
    if options.video is None:
        raise FootageError(f"camera {options.name} has no video: name its file in cameras")
    return options.video


def _digest(video: Path, options: CameraOptions) -> str:
    try:
        digest = hashlib.sha256(video.read_bytes()).hexdigest()
    except OSError:
        raise FootageError(f"{video}: there is no such video: check the path, or fetch the footage") from None
    if options.video_sha256 not in (None, digest):
        raise FootageError(f"{video}: is not the video that the scenario was made with (its SHA-256 differs)")
    return digest
