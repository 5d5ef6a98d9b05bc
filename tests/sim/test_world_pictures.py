import cv2
import numpy as np
import pytest

from nodes.imaging.camera import Camera, look_at
from sim.world.colors import bgr
from sim.world.figure import figures
from sim.world.light import LightingOptions, build_light, gain_at
from sim.world.mesh import views
from sim.world.people import Pose
from sim.world.renderer import Renderer
from sim.world.visibility import visibility
from sim.world.world import WorldOptions, build_world

SIZE = (320, 240)
PLAIN = {
    "noise": 0,
    "lighting": {"camera_spread": 0},
    "room": {"size": [16, 16]},
    "walls": {"posters": 0, "doors": 0, "windows": 0},
    "floor": {"blotches": 0},
}
BLUE = {"name": "anna", "path": [{"time_s": 0, "position": [0, 0]}], "upper": "#233ca5"}


def camera(name="C1", position=(-5.0, -3.0, 2.8), target=(0.0, 0.0, 0.9), distortion=None):
    lens = np.zeros(5) if distortion is None else np.array(distortion)
    return look_at(name, np.array(position), np.array(target), 260.0, SIZE, lens)


def world(seed=0, **changes):
    return build_world(WorldOptions.model_validate({**PLAIN, **changes}), seed)


def walk(name, start, end, **others):
    path = [{"time_s": 0, "position": start}, {"time_s": 2, "position": end}]
    return {"name": name, "path": path, **others}


def magenta(name, start, end):
    paint = dict.fromkeys(("upper", "lower", "skin", "hair"), "#ff00ff")
    return walk(name, start, end, **paint)


def is_magenta(frame):
    blue, green, red = frame.astype(int).transpose(2, 0, 1)
    return (np.minimum(blue, red) - green) > 22


def test_frames_depend_on_seed_camera_and_number_and_not_on_the_order_asked():
    crowd = {"people": [walk("anna", [-1, 0], [1, 1]), walk("bob", [1, 0], [-1, 0])], "noise": 3}
    first, second = Renderer(world(**crowd), camera()), Renderer(world(**crowd), camera())
    forwards = [first.frame(k, k / 10) for k in range(4)]
    backwards = [second.frame(k, k / 10) for k in reversed(range(4))][::-1]
    np.testing.assert_array_equal(forwards, backwards)
    assert not np.array_equal(forwards[0], first.frame(1, 0.0))
    assert not np.array_equal(forwards[0], Renderer(world(1, **crowd), camera()).frame(0, 0.0))
    assert not np.array_equal(forwards[0], Renderer(world(**crowd), camera("C2")).frame(0, 0.0))


def test_changing_light_does_not_make_frames_depend_on_the_order():
    light = {"camera_spread": 0.05, "keyframes": [{"time_s": 0}, {"time_s": 1, "brightness": 0.6}]}
    renderer = Renderer(world(lighting=light), camera())
    frames = [renderer.frame(k, k / 4) for k in range(5)]
    np.testing.assert_array_equal(frames[1], renderer.frame(1, 0.25))
    assert frames[4].mean() == pytest.approx(0.6 * frames[0].mean(), rel=0.02)


@pytest.mark.parametrize("position", [(-5.0, -3.0, 2.8), (4.0, 4.0, 2.8), (5.0, -2.0, 2.2)])
@pytest.mark.parametrize("upper", ["#233ca5", "#deded8", "#962d28"])
def test_clothes_have_their_colours(position, upper):
    view = camera(position=position)
    frame = Renderer(world(people=[{**BLUE, "upper": upper}]), view).frame(0, 0.0)
    # the middle of the torso, 0.48 to 0.86 of 1.75 m
    pixels, _ = view.project(np.array([[0.0, 0.0, z] for z in np.linspace(1.0, 1.4, 9)]))
    columns, rows = np.rint(pixels).astype(int).T
    colors = frame[rows, columns].astype(float)
    assert np.abs(colors.mean(axis=0) - bgr(upper)).max() < 0.12 * 255
    assert np.abs(colors.mean(axis=0) / bgr(upper) - 1).max() < 0.25
    assert (colors.std(axis=0) < 0.08 * bgr(upper) + 3).all()


def test_people_look_the_same_in_a_crowd_as_alone():
    poses = [
        Pose(np.array([x, 0.5]), heading, 1.0 + x, 0.8, height, 1.75)
        for x, heading, height in ((-1.0, 0.3, 1.75), (0.5, 2.5, 1.1), (60.0, 0.0, 1.75))
    ]
    palettes = [np.full((5, 3), 60.0 + 40 * i) for i in range(3)]
    crowd = views(figures(poses, palettes), camera())
    for together, pose, palette in zip(crowd, poses, palettes, strict=True):
        (alone,) = views(figures([pose], [palette]), camera())
        np.testing.assert_allclose(together.polygons, alone.polygons)
        np.testing.assert_allclose(together.colors, alone.colors)
        assert together.pictured == alone.pictured == 1.0


def test_feet_head_and_width_are_where_the_camera_projects_them():
    view = camera()
    options = {"people": [magenta("anna", [0.3, -0.4], [0.3, -0.4])]}
    frame = Renderer(world(**options), view).frame(0, 0.0)
    rows, columns = np.nonzero(is_magenta(frame))
    (foot, head), _ = view.project(np.array([[0.3, -0.4, 0.0], [0.3, -0.4, 1.75]]))
    assert rows.min() == pytest.approx(head[1], abs=2)
    assert rows.max() == pytest.approx(foot[1], abs=4)  # shoes reach a little towards the camera
    assert columns.mean() == pytest.approx((foot[0] + head[0]) / 2, abs=2)
    scale = (foot[1] - head[1]) / 1.75
    assert 0.3 < np.ptp(columns) / scale < 0.6


def test_a_distorted_picture_undistorts_to_the_straight_one():
    lens = [-0.28, 0.07, 0.001, -0.001, 0.0]
    busy = {"people": [{**BLUE}], "floor": {"colors": ["#ffffff", "#303030"], "blotches": 0}}
    straight = Renderer(world(**busy), camera()).frame(0, 0.0)
    bent = Renderer(world(**busy), camera(distortion=lens)).frame(0, 0.0)
    straightened = cv2.undistort(bent, camera().K, np.array(lens))
    middle = np.s_[30:-30, 40:-40]
    error = cv2.absdiff(straightened, straight)[middle].mean()
    assert error < 0.25 * cv2.absdiff(bent, straight)[middle].mean()
    assert error < 6


def test_light_has_the_colour_of_its_temperature():
    options = LightingOptions.model_validate(
        {"keyframes": [{"time_s": 1}, {"time_s": 3, "brightness": 0.85, "temperature_k": 4000}]}
    )
    light = build_light(options)
    np.testing.assert_allclose(gain_at(light, 0.0), 1.0)
    blue, green, red = gain_at(light, 3.0)
    assert green == pytest.approx(0.85)
    # Planck's law at the same wavelengths, in SI units

    def radiance(wavelength_m, temperature_k):
        h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23
        return wavelength_m**-5 / np.expm1(h * c / (wavelength_m * k * temperature_k))

    for gain, wavelength_m in ((blue, 465e-9), (red, 610e-9)):
        ratios = [radiance(x, 4000) / radiance(x, 6500) for x in (wavelength_m, 550e-9)]
        assert gain / green == pytest.approx(ratios[0] / ratios[1], rel=0.03)


def test_noise_has_its_size_and_differs_between_frames():
    quiet, noisy = Renderer(world(), camera()), Renderer(world(noise=4), camera())
    noise = [noisy.frame(k, 0.0).astype(float) - quiet.frame(k, 0.0) for k in range(2)]
    middle_grey = (quiet.frame(0, 0.0) > 20) & (quiet.frame(0, 0.0) < 235)
    assert noise[0][middle_grey].std() == pytest.approx(4, rel=0.02)
    assert abs(np.corrcoef(noise[0][middle_grey], noise[1][middle_grey])[0, 1]) < 0.02


def test_a_camera_outside_the_room_is_refused():
    with pytest.raises(ValueError, match=r"camera C1 .* outside the room"):
        Renderer(world(), camera(position=(-9.0, 0.0, 2.8)))


CROWD = {
    "people": [
        magenta("anna", [-1.5, 2.0], [2.5, -2.5]),
        walk("bob", [1.0, -2.0], [-2.5, 1.0], upper="#3f5a48"),
        walk("cleo", [-1.0, -2.0], [0.5, 2.0], upper="#8a8a8a"),
    ],
    "occluders": [
        {"start": [-2.5, -2.2], "end": [-1.2, -2.6], "top": 1.4},
        {"start": [-0.4, -1.0], "end": [-0.2, -1.0], "thickness": 0.2, "top": 2.6, "bottom": 0.0},
        {"start": [-3.5, 0.6], "end": [-3.0, 0.0], "top": 2.6, "bottom": 1.2},
    ],
}


@pytest.mark.parametrize("position", [(-5.0, -3.0, 2.8), (-4.5, 3.0, 2.6), (3.5, -4.0, 2.6)])
def test_visibility_is_what_counting_pixels_of_the_pictures_gives(position):
    view = camera(position=position, target=(-0.3, -0.3, 0.8))
    margin = 200
    K = view.K + np.array([[0, 0, margin], [0, 0, margin], [0, 0, 0]])
    wide = Camera("C1", SIZE[0] + 2 * margin, SIZE[1] + 2 * margin, K, view.R, view.t, view.distortion)
    inside = np.s_[margin:-margin, margin:-margin]
    crowd, alone = world(**CROWD), world(people=CROWD["people"][:1])
    everything, only_her = Renderer(crowd, view), Renderer(alone, wide)
    for time_s in np.linspace(0, 2, 11).tolist():
        whole = is_magenta(only_her.frame(0, time_s))
        n_inside = whole[inside].sum()
        shown = (is_magenta(everything.frame(0, time_s)) & whole[inside]).sum()
        truth = visibility(crowd, view, "anna", time_s)
        assert truth.in_view == pytest.approx(n_inside / whole.sum(), abs=0.04)
        if n_inside > 100:
            assert truth.occluded == pytest.approx(1 - shown / n_inside, abs=0.06)


def test_the_extremes_of_visibility():
    view = camera(position=(-5.0, 0.0, 2.8))
    wall = [{"start": [-2.0, -2.0], "end": [-2.0, 2.0], "top": 4.0}]
    ahead, behind = [walk("anna", [0, 0], [0, 0])], [walk("anna", [-6.5, 0], [-6.5, 0])]
    free = visibility(world(people=ahead), view, "anna", 0.0)
    assert (free.in_view, free.occluded) == (1.0, 0.0)
    hidden = visibility(world(people=ahead, occluders=wall), view, "anna", 0.0)
    assert (hidden.in_view, hidden.occluded) == (1.0, 1.0)
    away = visibility(world(people=behind), view, "anna", 0.0)
    assert (away.in_view, away.occluded) == (0.0, 0.0)
