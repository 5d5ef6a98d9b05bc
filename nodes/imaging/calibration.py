"""Calibration files made elsewhere, into cameras: OpenCV's and Qualisys' formats.

Files are checked before anything trusts them: a rotation that is none, or a lens model that the projection
does not know, would track to wrong places in silence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.parsers import expat

import cv2
import numpy as np
from jaxtyping import Float

from nodes.imaging.camera import Camera

_ROTATION_TOLERANCE = 1e-4  # files round to six digits or so

# The names that OpenCV's samples, documentation and users give to the same things; case and _ do not count.
_OPENCV_NAMES = {
    "cameramatrix": "camera_matrix",
    "intrinsicmatrix": "camera_matrix",
    "k": "camera_matrix",
    "distortioncoefficients": "distortion_coefficients",
    "distcoeffs": "distortion_coefficients",
    "d": "distortion_coefficients",
    "imagewidth": "image_width",
    "imageheight": "image_height",
    "imagesize": "image_size",
    "rotationmatrix": "R",
    "r": "R",
    "rvec": "rvec",
    "translation": "t",
    "tvec": "t",
    "t": "t",
}


class CalibrationError(Exception):
    """A calibration file cannot be used; the text names the file, the key and what to do."""


def read_opencv(path: Path, name: str) -> Camera:
    """Reads one camera from a file written with OpenCV's ``FileStorage`` (YAML, XML or JSON).

    It needs the intrinsic matrix (``camera_matrix`` or ``K``), the image size (``image_width`` and
    ``image_height``, or ``imageSize``), the rotation from world to camera (``R`` or ``rvec``) and the
    translation in metres (``t`` or ``tvec``). Distortion coefficients that are not there are zero, as
    everywhere in OpenCV.

    Args:
        path: The file.
        name: The camera's name.

    Raises:
        CalibrationError: The file cannot be read, lacks a key, or its numbers describe no such camera.
    """
    numbers = _opencv_numbers(path)

    def need(key: str, count: int) -> list[float]:
        if key not in numbers:
            raise CalibrationError(f"{path}: {key} is missing: add it, as cv2.FileStorage writes it")
        if len(numbers[key]) != count:
            raise CalibrationError(f"{path}: {key} must hold {count} numbers, got {len(numbers[key])}")
        return numbers[key]

    if "image_size" in numbers:
        size_px = need("image_size", 2)
    else:
        size_px = [*need("image_width", 1), *need("image_height", 1)]
    if "R" in numbers or "rvec" not in numbers:
        R = np.reshape(need("R", 9), (3, 3))
    else:
        R = np.asarray(cv2.Rodrigues(np.array(need("rvec", 3)))[0], dtype=np.float64)
    return checked_camera(
        f"{path}",
        name,
        size_px,
        np.reshape(need("camera_matrix", 9), (3, 3)),
        R,
        np.array(need("t", 3)),
        numbers.get("distortion_coefficients", []),
    )


def _opencv_numbers(path: Path) -> dict[str, list[float]]:
    """All numbers of a file, by one name for each thing."""
    if not path.is_file():
        raise CalibrationError(f"{path}: there is no such file: check the path")
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        root = storage.root()
        found = {key: _flat(root.getNode(key)) for key in root.keys()}  # noqa: SIM118, a FileNode is no mapping
        storage.release()
    except (cv2.error, SystemError, UnicodeDecodeError):
        raise CalibrationError(f"{path}: is not YAML, XML or JSON as cv2.FileStorage writes it") from None
    spoken = {key.replace("_", "").lower(): values for key, values in found.items()}
    if any(spoken.get("fisheyemodel", [])):
        raise CalibrationError(f"{path}: is a fisheye calibration: calibrate with k1, k2, p1, p2, k3 instead")
    return {_OPENCV_NAMES[key]: values for key, values in spoken.items() if key in _OPENCV_NAMES}


def _flat(node: cv2.FileNode) -> list[float]:
    """The numbers of a matrix, of nested lists, or a single one."""
    if node.isSeq():
        return [number for index in range(node.size()) for number in _flat(node.at(index))]
    if node.isMap():
        return _flat(node.getNode("data"))
    return [node.real()] if node.isInt() or node.isReal() else []


def read_qualisys(path: Path) -> dict[str, Camera]:
    """Reads the cameras of a Qualisys calibration (XML, ``*.qca.txt``) by their serial names.

    Focal lengths and centres are in units of 1/64 pixel, positions in millimetres. The rows of the r matrix
    are the camera's axes in the world with y up and z backward, hence R = diag(1, -1, -1) r and t = -R C.

    Raises:
        CalibrationError: The file cannot be read, lacks a value, or its numbers describe no such camera.
    """
    try:
        elements = _camera_elements(path)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error
    except expat.ExpatError as error:
        raise CalibrationError(
            f"{path}:{error.lineno}: is not XML: {expat.ErrorString(error.code)}"
        ) from None
    if not elements:
        raise CalibrationError(f"{path}: holds no <camera>: is it a Qualisys calibration?")
    cameras: dict[str, Camera] = {}
    for element in elements:
        camera = _qualisys_camera(element)
        if camera.name in cameras:
            raise CalibrationError(f"{path}: two cameras have the serial {camera.name}: rename one")
        cameras[camera.name] = camera
    return cameras


@dataclass(frozen=True, slots=True, eq=False)
class _Element:
    """One <camera> of a Qualisys file: the attributes of the elements in it, by tag."""

    path: Path
    attributes: dict[str, dict[str, str]] = field(default_factory=dict)

    def number(self, tag: str, key: str) -> float:
        serial = self.attributes["camera"].get("serial", "without a serial")
        try:
            return float(self.attributes[tag][key])
        except KeyError:
            raise CalibrationError(
                f"{self.path}: camera {serial}: <{tag} {key}> is missing: add it"
            ) from None
        except ValueError:
            text = self.attributes[tag][key]
            raise CalibrationError(
                f"{self.path}: camera {serial}: <{tag} {key}> is no number: {text}"
            ) from None


def _camera_elements(path: Path) -> list[_Element]:
    elements: list[_Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag == "camera":
            elements.append(_Element(path))
        if elements:
            elements[-1].attributes.setdefault(tag, attributes)

    def refuse(*_: object) -> None:
        # Without a document type there are no entities: nothing to expand, nothing to fetch.
        raise CalibrationError(f"{path}: has a DOCTYPE, which no calibration needs: remove it")

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.StartDoctypeDeclHandler = refuse
    parser.Parse(path.read_bytes(), True)  # noqa: FBT003, the C function takes no keywords
    return elements


def _qualisys_camera(element: _Element) -> Camera:
    number = element.number
    name = element.attributes["camera"].get("serial")
    if not name:
        raise CalibrationError(f"{element.path}: a <camera> has no serial: add it")
    if number("camera", "viewrotation"):
        raise CalibrationError(f"{element.path}: camera {name}: viewrotation must be 0: export it unrotated")
    left, top = number("fov_video", "left"), number("fov_video", "top")
    size_px = [number("fov_video", "right") - left + 1, number("fov_video", "bottom") - top + 1]
    K = (
        np.array(
            [
                [
                    number("intrinsic", "focalLengthU"),
                    number("intrinsic", "skew"),
                    number("intrinsic", "centerPointU"),
                ],
                [0.0, number("intrinsic", "focalLengthV"), number("intrinsic", "centerPointV")],
                [0.0, 0.0, 64.0],
            ]
        )
        / 64
    )
    K[:2, 2] -= left, top
    axes = np.array([[number("transform", f"r{row}{column}") for column in "123"] for row in "123"])
    center = np.array([number("transform", axis) for axis in "xyz"]) / 1000
    R = np.diag([1.0, -1.0, -1.0]) @ axes
    distortion = [
        number("intrinsic", "radialDistortion1"),
        number("intrinsic", "radialDistortion2"),
        number("intrinsic", "tangentalDistortion1"),
        number("intrinsic", "tangentalDistortion2"),
        number("intrinsic", "radialDistortion3"),
    ]
    return checked_camera(f"{element.path}: camera {name}", name, size_px, K, R, -R @ center, distortion)


def checked_camera(
    source: str,
    name: str,
    size_px: Sequence[float],
    K: Float[np.ndarray, "3 3"],
    R: Float[np.ndarray, "3 3"],
    t: Float[np.ndarray, " 3"],
    distortion: Sequence[float],
) -> Camera:
    """A camera, after checking that its numbers can be one's.

    Args:
        source: Whose numbers they are, for the error.
        name: The camera.
        size_px: Width and height of its pictures.
        K: Intrinsic matrix, in pixels.
        R: Rotation from world to camera axes.
        t: Translation in metres.
        distortion: Up to five coefficients in OpenCV's order.

    Raises:
        CalibrationError: They cannot be a camera's.
    """
    if not all(np.isfinite(values).all() for values in (size_px, K, R, t, distortion)):
        raise CalibrationError(f"{source}: some numbers are not finite: calibrate again")
    if any(pixels < 1 or pixels != round(pixels) for pixels in size_px):
        raise CalibrationError(f"{source}: the image size must be two whole numbers of pixels, got {size_px}")
    if min(K[0, 0], K[1, 1]) <= 0 or K[1, 0] != 0 or (K[2] != [0, 0, 1]).any():
        raise CalibrationError(
            f"{source}: the intrinsic matrix must be [f s c; 0 f c; 0 0 1], got {K.tolist()}"
        )
    if np.abs(R @ R.T - np.eye(3)).max() > _ROTATION_TOLERANCE or np.linalg.det(R) < 0:
        raise CalibrationError(f"{source}: R is no rotation (orthonormal, determinant +1), got {R.tolist()}")
    if any(distortion[5:]):
        raise CalibrationError(f"{source}: only k1, k2, p1, p2, k3 are known here: calibrate with these five")
    coefficients = np.zeros(5)
    coefficients[: len(distortion[:5])] = distortion[:5]
    width_px, height_px = (round(pixels) for pixels in size_px)
    return Camera(name, width_px, height_px, K, R, t, coefficients)


def scaled(camera: Camera, factor: float) -> Camera:
    """The camera of a picture resized by a factor, as ``cv2.resize`` does it.

    Pixel (0, 0) is the centre of the top left pixel, so that u' = (u + 0.5) s - 0.5.

    Args:
        camera: The camera of the full picture.
        factor: s, above 0; below 1 the picture shrinks.
    """
    # K' = S K with S = [s 0 (s-1)/2; 0 s (s-1)/2; 0 0 1]
    shift = (factor - 1) / 2
    S = np.array([[factor, 0, shift], [0, factor, shift], [0, 0, 1.0]])
    return replace(
        camera,
        K=S @ camera.K,
        width_px=round(camera.width_px * factor),
        height_px=round(camera.height_px * factor),
    )


def cropped(camera: Camera, width_px: int, height_px: int) -> Camera:
    """The camera of a picture that lost columns on the right or rows at the bottom; its intrinsics hold.

    Raises:
        ValueError: The picture is larger than the camera's.
    """
    if width_px > camera.width_px or height_px > camera.height_px:
        raise ValueError(
            f"camera {camera.name} is calibrated for {camera.width_px} x {camera.height_px} pixels, "
            f"its pictures have {width_px} x {height_px}: read the calibration that belongs to them"
        )
    return replace(camera, width_px=width_px, height_px=height_px)
