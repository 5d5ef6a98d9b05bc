"""Recordings as anybody reads them: with the official reader, Foxglove's schemas, and nothing of ours."""

import json
from collections import defaultdict
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from network.wire.messages import EstimateMessage, PreviewMessage
from nodes.vision.target import project_boxes
from sim.assembly import Assembly
from sim.recording import foxglove
from sim.recording.film import McapFilm
from sim.results.recorder import Recorder, RecordingError
from sim.running.in_process import run_in_process
from sim.scenario.loading import load_scenario

WICA = Path(__file__).parents[3] / "scenarios" / "wica.yaml"

SCHEMAS = {
    "/tf": "foxglove.FrameTransforms",
    "/scene": "foxglove.SceneUpdate",
    "/log": "foxglove.Log",
    "/A/image": "foxglove.CompressedImage",
    "/A/calibration": "foxglove.CameraCalibration",
    "/A/particles": "foxglove.PointCloud",
    "/A/boxes/dcpf": "foxglove.ImageAnnotations",
    "/A/boxes/truth": "foxglove.ImageAnnotations",
    "dcpf/small/A/estimate": "dcpf.estimate.v1",
    "dcpf/small/A/status": "dcpf.status.v1",
    "dcpf/small/A/alive": "dcpf.alive.v1",
    "dcpf/small/truth": "dcpf.truth.v1",
}


def read(path):
    """Messages by topic, protobuf ones decoded; and the schema of each topic."""
    found, schemas = defaultdict(list), {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        factory = DecoderFactory()
        for schema, channel, message in reader.iter_messages():
            schemas[channel.topic] = schema.name
            decoder = factory.decoder_for(channel.message_encoding, schema)
            found[channel.topic].append(
                (message.log_time, decoder(message.data) if decoder else message.data)
            )
    return found, schemas


def test_the_official_reader_finds_everything_in_foxgloves_schemas(recorded):
    run = recorded()
    found, schemas = read(run.film)

    assert schemas.items() >= SCHEMAS.items()
    for topic in ("/A/image", "/A/particles", "/D/boxes/cpf", "dcpf/small/truth"):
        assert [time for time, _ in found[topic]] == [round(1e8 * k) for k in range(6)]
    # what we told, byte for byte
    own = [data for topic, rows in found.items() if topic.endswith("/estimate") for _, data in rows]
    assert sorted(own) == sorted(run.lines("estimates"))
    assert [data for _, data in found["dcpf/small/truth"]] == run.lines("truth")
    assert [json.loads(data) for _, data in found["dcpf/small/B/alive"]] == [
        {"alive": True},
        {"alive": False},
    ]


def test_pictures_are_those_of_the_cameras(recorded):
    run = recorded()
    found, _ = read(run.film)
    source = run.assembly.source("C")
    for index, (_, shown) in enumerate(found["/C/image"]):
        assert (shown.frame_id, shown.format) == ("C", "jpeg")
        picture = cv2.imdecode(np.frombuffer(shown.data, np.uint8), cv2.IMREAD_COLOR)
        assert np.abs(picture.astype(int) - source.read(index)).mean() < 6
    sent = [each for each in run.told if isinstance(each, PreviewMessage) and each.node == "C"]
    for preview, (_, cloud) in zip(sent, found["/C/particles"], strict=True):
        points = np.frombuffer(cloud.data, "<f4").reshape(-1, 3)
        np.testing.assert_allclose(points[:, :2], preview.particles, atol=1e-5)
        assert (points[:, 2] == 0).all()


def test_cameras_project_the_same_from_the_recording(recorded):
    """A point of the world through the recorded transform and calibration, by OpenCV and SciPy."""
    run = recorded()
    found, _ = read(run.film)
    ((_, transforms),) = found["/tf"]
    points = np.random.default_rng(0).uniform([-2, 1, 0], [2, 5, 2], (20, 3))
    for transform in transforms.transforms:
        ((_, calibration),) = found[f"/{transform.child_frame_id}/calibration"]
        assert (calibration.width, calibration.height) == (160, 120)
        q, c = transform.rotation, transform.translation
        turn = Rotation.from_quat([q.x, q.y, q.z, q.w]).inv().as_matrix()
        shift = -turn @ [c.x, c.y, c.z]
        K, D = np.reshape(calibration.K, (3, 3)), np.array(calibration.D)
        expected, _ = cv2.projectPoints(points, cv2.Rodrigues(turn)[0], shift, K, D)
        pixels, depths = run.assembly.cameras[transform.child_frame_id].project(points)
        np.testing.assert_allclose(pixels[depths > 0.5], expected[depths > 0.5, 0], atol=1e-6)


@pytest.mark.parametrize("degrees", [0, 1e-7, 30, 90, 179, 180])
def test_quaternions_are_scipys(degrees):
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.0, 0.8]))
    q = foxglove.rotation(turn.as_matrix())
    ours = np.array([q.x, q.y, q.z, q.w])
    assert min(np.abs(ours - turn.as_quat()).max(), np.abs(ours + turn.as_quat()).max()) < 1e-7


def test_the_scene_holds_estimates_with_their_ellipses(recorded):
    run = recorded()
    found, _ = read(run.film)
    entities = defaultdict(dict)
    for time, update in found["/scene"]:
        for entity in update.entities:
            entities[entity.id][time] = entity
    assert {"graph", "view/A", "dcpf/A", "dcpf/D", "cpf/central", "single/B", "truth"} <= entities.keys()
    (graph,) = entities["graph"][0].lines
    assert len(graph.points) == 2 * 4  # a ring of four
    for message in (each for each in run.told if isinstance(each, EstimateMessage)):
        entity = entities[f"{message.estimator}/{message.node}"][round(1e8 * message.frame)]
        ball = entity.spheres[0].pose.position
        np.testing.assert_allclose([ball.x, ball.y], message.mean[:2])
        # every point of the rim is two standard deviations away
        rim = np.array([[p.x, p.y] for p in entity.lines[0].points]) - message.mean[:2]
        distances = np.einsum("ij,jk,ik->i", rim, np.linalg.inv(message.covariance[:2, :2]), rim)
        np.testing.assert_allclose(distances, 4, rtol=1e-6)
    gone = [each.id for _, update in found["/scene"] for each in update.deletions]
    assert {"dcpf/B", "single/B"} <= set(gone)
    assert [line.message for _, line in found["/log"]][-1] == "B: lost frame=5"


def test_boxes_lie_where_the_target_is_projected(recorded):
    run = recorded()
    found, _ = read(run.film)
    target, camera = run.assembly.scenario.target, run.assembly.cameras["A"]
    for index, (_, annotations) in enumerate(found["/A/boxes/truth"]):
        box = project_boxes(run.assembly.truth[index : index + 1, :2], target, camera)[0]
        corners = np.array([[p.x, p.y] for p in annotations.points[0].points])
        np.testing.assert_allclose(corners.min(axis=0) + 0.5, box[:2])
        np.testing.assert_allclose(corners.max(axis=0) + 0.5, box[2:])


def test_the_scenario_is_in_the_file(recorded):
    run = recorded()
    with run.film.open("rb") as file:
        (attached,) = make_reader(file).iter_attachments()
    assert attached.name == "scenario.json"
    assert json.loads(attached.data)["seed"] == run.assembly.scenario.seed


def test_targets_in_a_volume_are_recorded_at_their_height(recorded):
    volume = (
        ("target.space", "volume"),
        ("target.start.velocity", "[0.0, 1.5, 0.0]"),
        ("frames", "3"),
    )
    run = recorded(*volume)
    found, _ = read(run.film)
    balls = [
        entity.spheres[0].pose.position.z
        for _, update in found["/scene"]
        for entity in update.entities
        if entity.id == "dcpf/A"
    ]
    means = [
        m.mean[2]
        for m in run.told
        if isinstance(m, EstimateMessage) and (m.estimator, m.node) == ("dcpf", "A")
    ]
    np.testing.assert_allclose(balls, means)


def test_a_camera_that_tracks_in_its_image_plane_has_no_place_in_the_world(tmp_path):
    assembly = Assembly(load_scenario(WICA, [("frames", "3"), ("filter.n_particles", "50")]))
    with Recorder(tmp_path / "wica", assembly.scenario, partial(McapFilm, assembly=assembly)) as recorder:
        told = list(run_in_process(assembly, watched=True))
        for message in told:
            recorder.add(message)
        recorder.event("lost", "C1", frame=2)
    found, schemas = read(tmp_path / "wica" / "run.mcap")
    assert not {"/scene", "/tf", "/C1/calibration"} & schemas.keys()
    assert schemas["/C1/particles"] == "foxglove.ImageAnnotations"
    previews = [each for each in told if isinstance(each, PreviewMessage)]
    for preview, (_, annotations) in zip(previews, found["/C1/particles"], strict=True):
        (dots,) = annotations.points
        np.testing.assert_allclose([[p.x, p.y] for p in dots.points], preview.particles)
    assert len(found["/C1/boxes/dcpf"]) == 3


def test_a_camera_that_was_knocked_stays_in_the_scene(small, tmp_path):
    assembly = Assembly(load_scenario(small, []))
    film = McapFilm(tmp_path / "run.mcap", assembly)
    film.event("knocked", "B", {"frame": 2, "frames": 3})
    film.event("lost", "C", {"frame": 3})
    film.close()
    found, _ = read(tmp_path / "run.mcap")
    gone = {each.id for _, update in found["/scene"] for each in update.deletions}
    assert gone == {"dcpf/C", "cpf/C", "single/C"}
    assert next(line.message for _, line in found["/log"]) == "B: knocked frame=2 frames=3"


def test_a_film_of_an_earlier_run_does_not_stay(recorded):
    run = recorded()
    assert run.film.exists()
    with Recorder(run.folder, run.assembly.scenario):
        pass
    assert not run.film.exists()


def test_a_full_disk_is_a_sentence(recorded, tmp_path):
    run = recorded(("frames", "2"))

    def onto_a_full_disk(path):
        path.symlink_to("/dev/full")
        return McapFilm(path, run.assembly)

    def record():
        with Recorder(tmp_path / "full", run.assembly.scenario, onto_a_full_disk) as recorder:
            for message in run.told:
                recorder.add(message)

    with pytest.raises(RecordingError, match="No space left on device"):
        record()
