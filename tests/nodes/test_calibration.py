"""Calibration files: what is written by others' conventions comes back as the same camera."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from nodes.imaging.calibration import CalibrationError, cropped, read_opencv, read_qualisys, scaled
from nodes.imaging.camera import Camera


@pytest.fixture
def camera():
    R = cv2.Rodrigues(np.array([1.2, -0.7, 0.4]))[0]
    K = np.array([[1681.25, 0, 532.9], [0, 1681.0, 948.2], [0, 0, 1]])
    return Camera(
        "C1", 1088, 1920, K, R, np.array([0.3, -1.1, 4.2]), np.array([-0.05, 0.14, 6e-4, 7e-4, 0.01])
    )


def assert_same(found, camera):
    assert (found.name, found.width_px, found.height_px) == (camera.name, camera.width_px, camera.height_px)
    for name in ("K", "R", "t", "distortion"):
        np.testing.assert_allclose(getattr(found, name), getattr(camera, name), atol=1e-9, err_msg=name)


def opencv_file(path, **values):
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()
    return path


def opencv_values(camera):
    return {
        "camera_matrix": camera.K,
        "distortion_coefficients": camera.distortion,
        "image_width": camera.width_px,
        "image_height": camera.height_px,
        "R": camera.R,
        "t": camera.t,
    }


@pytest.mark.parametrize("extension", ["yml", "xml", "json"])
def test_opencv_files_of_each_format_are_read(tmp_path, camera, extension):
    path = opencv_file(tmp_path / f"c1.{extension}", **opencv_values(camera))
    assert_same(read_opencv(path, "C1"), camera)


def test_opencv_files_with_other_usual_names_are_read(tmp_path, camera):
    values = {
        "K": camera.K,
        "dist_coeffs": camera.distortion[None, :4],
        "imageSize": np.array([camera.width_px, camera.height_px]),
        "rvec": cv2.Rodrigues(camera.R)[0],
        "tvec": camera.t[:, None],
    }
    found = read_opencv(opencv_file(tmp_path / "c1.yml", **values), "C1")
    assert_same(found, replace(camera, distortion=np.array([*camera.distortion[:4], 0])))


def test_plain_lists_in_json_are_read_and_no_distortion_is_none(tmp_path, camera):
    values = {
        "K": camera.K.tolist(),
        "imageSize": [1088, 1920],
        "R": camera.R.ravel().tolist(),
        "T": camera.t.tolist(),
    }
    path = tmp_path / "c1.json"
    path.write_text(json.dumps(values))
    assert_same(read_opencv(path, "C1"), replace(camera, distortion=np.zeros(5)))


@pytest.mark.parametrize("key", ["camera_matrix", "image_width", "image_height", "R", "t"])
def test_a_key_that_is_missing_is_named(tmp_path, camera, key):
    values = opencv_values(camera)
    del values[key]
    with pytest.raises(CalibrationError, match=rf"c1\.yml: {key} is missing"):
        read_opencv(opencv_file(tmp_path / "c1.yml", **values), "C1")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"R": np.diag([1.0, 1, -1])}, "R is no rotation"),
        ({"R": 1.01 * np.eye(3)}, "R is no rotation"),
        ({"R": np.eye(2)}, "R must hold 9 numbers, got 4"),
        ({"t": np.array([0, np.nan, 0])}, "not finite"),
        ({"camera_matrix": np.diag([-5.0, 5, 1])}, "intrinsic matrix must be"),
        ({"camera_matrix": np.diag([5.0, 5, 2])}, "intrinsic matrix must be"),
        ({"image_width": 0}, "image size must be"),
        ({"image_width": 640.5}, "image size must be"),
        ({"distortion_coefficients": np.ones(8)}, "only k1, k2, p1, p2, k3"),
        ({"fisheye_model": 1}, "fisheye"),
    ],
)
def test_numbers_that_describe_no_such_camera_are_refused(tmp_path, camera, changed, message):
    with pytest.raises(CalibrationError, match=message):
        read_opencv(opencv_file(tmp_path / "c1.yml", **(opencv_values(camera) | changed)), "C1")


@pytest.mark.parametrize("content", [b"", b"K: [1", bytes(range(256)), b"<opencv_storage><K>"])
def test_files_that_opencv_cannot_read_are_named(tmp_path, content):
    path = tmp_path / "c1.yml"
    path.write_bytes(content)
    with pytest.raises(CalibrationError, match=r"c1\.yml"):
        read_opencv(path, "C1")
    with pytest.raises(CalibrationError, match="no such file"):
        read_opencv(tmp_path / "other.yml", "C1")


def qualisys_camera(camera, left=0, top=0):
    """A <camera> by Qualisys' conventions: axes with y up and z backward, 1/64 pixels, millimetres."""
    axes = np.stack([camera.R[0], -camera.R[1], -camera.R[2]])
    transform = " ".join(f'r{i + 1}{j + 1}="{float(axes[i, j])!r}"' for i in range(3) for j in range(3))
    x, y, z = (float(coordinate) * 1000 for coordinate in camera.center)
    k1, k2, p1, p2, k3 = camera.distortion
    K = 64 * (camera.K + np.array([[0, 0, left], [0, 0, top], [0, 0, 0]]))
    right, bottom = left + camera.width_px - 1, top + camera.height_px - 1
    return f"""<camera active="1" serial="{camera.name}" viewrotation="0">
      <fov_video left="{left}" top="{top}" right="{right}" bottom="{bottom}"/>
      <transform {transform} x="{x!r}" y="{y!r}" z="{z!r}"/>
      <intrinsic centerPointU="{K[0, 2]}" centerPointV="{K[1, 2]}"
        focalLengthU="{K[0, 0]}" focalLengthV="{K[1, 1]}"
        radialDistortion1="{k1}" radialDistortion2="{k2}" radialDistortion3="{k3}" skew="0.0"
        tangentalDistortion1="{p1}" tangentalDistortion2="{p2}"/></camera>"""


def qualisys_file(path, *cameras):
    path.write_text(f'<?xml version="1.0"?><calibration><cameras>{"".join(cameras)}</cameras></calibration>')
    return path


def test_qualisys_cameras_are_read_by_their_serials(tmp_path, camera):
    other = replace(camera, name="C2", t=np.array([1.0, 2.0, 3.0]))
    path = qualisys_file(
        tmp_path / "a.qca.txt", qualisys_camera(camera), qualisys_camera(other, left=8, top=4)
    )
    found = read_qualisys(path)
    assert list(found) == ["C1", "C2"]
    assert_same(found["C1"], camera)
    assert_same(found["C2"], other)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('focalLengthU="', 'focalLength="', "camera C1: <intrinsic focalLengthU> is missing"),
        ("<transform", "<transformation", "camera C1: <transform r11> is missing"),
        ('skew="0.0"', 'skew="none"', "<intrinsic skew> is no number: none"),
        ('viewrotation="0"', 'viewrotation="90"', "viewrotation must be 0"),
        ('serial="C1"', 'serial=""', "no serial"),
        ('r11="', 'r11="1', "camera C1: R is no rotation"),
        ("<camera ", "<cam ", "is not XML"),
        ("<calibration>", '<!DOCTYPE c [<!ENTITY e "ha">]><calibration>&e;', "has a DOCTYPE"),
    ],
)
def test_qualisys_files_with_a_flaw_are_refused(tmp_path, camera, old, new, message):
    path = qualisys_file(tmp_path / "a.qca.txt", qualisys_camera(camera))
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(CalibrationError, match=message):
        read_qualisys(path)


def test_qualisys_files_without_cameras_or_with_one_twice_are_refused(tmp_path, camera):
    with pytest.raises(CalibrationError, match="holds no <camera>"):
        read_qualisys(qualisys_file(tmp_path / "a.qca.txt"))
    with pytest.raises(CalibrationError, match="two cameras have the serial C1"):
        read_qualisys(qualisys_file(tmp_path / "a.qca.txt", qualisys_camera(camera), qualisys_camera(camera)))
    with pytest.raises(CalibrationError, match="cannot be read: No such file"):
        read_qualisys(tmp_path / "b.qca.txt")


@pytest.mark.parametrize("factor", [0.25, 0.3, 0.5])
def test_a_resized_picture_shows_a_spot_where_the_scaled_camera_projects_it(factor):
    K = np.array([[400.0, 0, 161.3], [0, 400, 118.2], [0, 0, 1]])
    camera = Camera("C1", 324, 243, K, np.eye(3), np.zeros(3), np.array([-0.1, 0, 0, 0, 0.0]))
    point = np.array([[0.12, -0.09, 1.0]])
    ((u, v),) = camera.project(point)[0]
    rows, columns = np.mgrid[:243, :324]
    picture = np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 8.0**2))
    small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    half = scaled(camera, factor)
    assert small.shape == (half.height_px, half.width_px)
    rows, columns = np.mgrid[: half.height_px, : half.width_px]
    spot = np.array([(columns * small).sum(), (rows * small).sum()]) / small.sum()
    np.testing.assert_allclose(half.project(point)[0][0], spot, atol=0.02)


def test_a_crop_on_the_right_keeps_the_intrinsics_and_cannot_grow(camera):
    narrow = cropped(camera, 1080, 1920)
    assert (narrow.width_px, narrow.height_px) == (1080, 1920)
    np.testing.assert_array_equal(narrow.K, camera.K)
    with pytest.raises(
        ValueError, match="C1 is calibrated for 1088 x 1920 pixels, its pictures have 1090 x 1920"
    ):
        cropped(camera, 1090, 1920)
