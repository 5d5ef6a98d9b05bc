"""Video files as a source of frames."""

import cv2
import numpy as np
import pytest

from nodes.imaging.sources import SourceError, VideoSource

N_FRAMES = 12


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    """A video whose frames are grey, each brighter than the one before, with a blue left half."""
    path = tmp_path_factory.mktemp("video") / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    for index in range(N_FRAMES):
        picture = np.full((48, 64, 3), 20 * index, dtype=np.uint8)
        picture[:, :32, 0] = 255
        writer.write(picture)
    writer.release()
    return path


def brightness(picture):
    return picture[:, 40:, 1].mean()


def test_frames_come_in_order_as_blue_green_red(video):
    source = VideoSource(video)
    for index in range(N_FRAMES):
        picture = source.read(index)
        assert picture.shape == (48, 64, 3)
        assert picture.dtype == np.uint8
        assert brightness(picture) == pytest.approx(20 * index, abs=3)
        assert picture[:, :24, 0].mean() > 245
    source.close()


def test_frames_in_between_can_be_left_out(video):
    source = VideoSource(video)
    assert [round(brightness(source.read(index)) / 20) for index in (0, 3, 4, 11)] == [0, 3, 4, 11]
    with pytest.raises(ValueError, match="frame 3 has gone by, the next is 12"):
        source.read(3)
    source.close()


def test_pictures_are_scaled_on_reading(video):
    source, full = VideoSource(video, scale=0.25), VideoSource(video)
    small = source.read(5)
    assert small.shape == (12, 16, 3)
    blocks = full.read(5).reshape(12, 4, 16, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(small, blocks, atol=1)
    source.close()
    full.close()


def test_a_video_that_is_too_short_says_how_many_frames_it_has(video):
    source = VideoSource(video)
    with pytest.raises(SourceError, match=r"clip\.avi: the video ends after 12 frames, frame 50 was asked"):
        source.read(50)
    source.close()


def test_what_is_no_video_is_refused(tmp_path):
    with pytest.raises(SourceError, match="no such video"):
        VideoSource(tmp_path / "clip.mp4")
    (tmp_path / "clip.mp4").write_bytes(b"no video at all")
    with pytest.raises(SourceError, match=r"clip\.mp4: OpenCV cannot decode"):
        VideoSource(tmp_path / "clip.mp4")
