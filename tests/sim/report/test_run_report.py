"""The page of a run: valid, whole in itself, and it says what the folder says."""

import json
import re
import shutil
import textwrap

import cv2
import numpy as np
import pytest

from sim.assembly import Assembly
from sim.pictures.ground import ellipse
from sim.pictures.theme import PARTICLE
from sim.report import stills
from sim.report.figures import plot_members
from sim.report.retelling import told_again
from sim.report.stills import choose_moments, moments_of
from sim.results.recorder import read_run
from sim.results.results import Results
from sim.world.colors import bgr

HTML = "{http://www.w3.org/1999/xhtml}"
HOSTILE = "<script>alert('1')</script> & \"<img src=x onerror=alert(1)>"


def test_a_report_says_what_the_folder_says(dcpf, ran, small, page):
    folder = ran(small)
    summary = json.loads((folder / "summary.json").read_text())

    result = dcpf("report", folder)

    assert result.exit_code == 0
    assert result.stdout.strip() == str(folder / "report.html")
    read = page(folder / "report.html")
    assert read.text("h1") == "small"
    assert [heading.text for heading in read.all("h2")] == [
        "What was run",
        "How exact it was",
        "Where it was",
        "What the cameras saw",
        "How the network agreed",
        "How long it took",
        "The scenario",
    ]
    figures = read.rows("Errors over frames")
    assert figures["DCPF, all nodes"][0] == f"{summary['rmse_m']['dcpf']:.3f}"
    assert figures["A alone"][0] == f"{summary['rmse_m']['single']['A']:.3f}"
    assert f"numpy {summary['versions']['numpy']}" in read.text()
    # Three rounds on a ring; the links of a kind together are what the summary says.
    links = read.rows("What each link carries")
    rounds = [cells for cells in links.values() if cells[0] == "rounds"]
    assert len(rounds) == 8
    assert {cells[1] for cells in rounds} == {"3"}
    total = sum(float(cells[2].replace(",", "")) for cells in rounds)
    assert total == pytest.approx(summary["network"]["bytes_per_frame"]["dcpf"], abs=4)
    # a picture of each camera at each moment
    assert len(read.all("img")) == 4 * len(read.all("h3")) > 0
    assert "n_particles: 40" in read.text("pre")


BAD_LINKS = ("--set", "network.conditions={loss: 0.2, duplicates: 0.3}")
HANG = ("--set", "faults=[{kind: hang, node: B, frame: 3, frames: 3}]")


def test_a_report_tells_of_messages_and_members(dcpf, ran, small, page):
    folder = ran(small, *BAD_LINKS, *HANG, "--set", "frames=10")
    summary = json.loads((folder / "summary.json").read_text())
    assert dcpf("report", folder).exit_code == 0

    read = page(folder / "report.html")

    network = summary["network"]
    assert min(network["lost"], network["duplicated"]) > 0
    fates = read.rows("What became of the messages")
    assert {words.partition(":")[0]: int(count) for words, (count,) in list(fates.items())[1:]} == {
        "lost": network["lost"],
        "late": network["late_messages"],
        "duplicated": network["duplicated"],
        "dropped": network["dropped"],
        "refused": network["refused"],
    }
    (frames,) = [table for table in read.all("table") if "Lost and back" in "".join(table.itertext())]
    words = [["".join(cell.itertext()) for cell in row] for row in list(frames.iter(f"{HTML}tr"))[1:]]
    assert words == [
        [each["node"], each["event"], str(each["frame"])] for each in summary["members"]["events"]
    ]
    assert [each[:2] for each in words] == [["B", "lost"], ["B", "back"]]
    assert "How many cameras take part" in read.text()


def test_a_report_tells_what_a_frame_costs_on_the_array(dcpf, ran, small, page):
    folder = ran(small, "--set", "filter.backend=simd")
    cost = json.loads((folder / "summary.json").read_text())["simd"]
    assert dcpf("report", folder).exit_code == 0

    rows = page(folder / "report.html").rows("On a camera's processor array")

    assert rows["cycles"] == [f"{cost['cycles']:,}"]
    assert rows["line memory"] == [f"{cost['line_memory_words']} of 64 words"]
    assert rows["time at 80 MHz"] == [f"{cost['frame_us'] / 1000:.3g} ms"]


def test_members_are_drawn_as_they_were_counted(ran, small):
    folder = ran(small, *HANG, "--set", "frames=10")
    results, summary = read_run(folder), json.loads((folder / "summary.json").read_text())
    (axes,) = plot_members(results, summary["members"]["per_frame"]).axes
    most, fewest = (line.get_ydata() for line in axes.get_lines())
    told = summary["members"]["per_frame"]
    for frame in range(10):
        counts = [each[frame] for each in told.values() if each[frame] is not None]
        assert (most[frame], fewest[frame]) == (max(counts), min(counts))
    assert min(fewest) == 3
    assert most[-1] == 4


def test_the_same_run_gives_the_same_page(dcpf, ran, small, tmp_path):
    folder = ran(small)
    for name in ("one", "two"):
        assert dcpf("report", folder, "--out", tmp_path / name).exit_code == 0
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_particles_are_those_of_the_run(ran, small):
    folder = ran(small)
    results = read_run(folder)
    assembly = Assembly(results.scenario)

    previews = told_again(results, assembly, [2, 4], lambda _: None)

    assert list(previews) == [2, 4]
    for frame, cameras in previews.items():
        for name, preview in cameras.items():
            told = results.tracks["dcpf", name][frame]
            # 40 equally weighted particles stand for the mean that was told
            deviation = np.sqrt(np.diag(told.covariance)[:2])
            assert (np.abs(preview.particles.mean(axis=0) - told.mean[:2]) < deviation).all()


def test_particles_of_another_run_are_left_out(ran, small):
    results = read_run(ran(small))
    other = Assembly(results.scenario.model_copy(update={"seed": 1}))
    previews = told_again(results, other, [3], lambda _: None)
    assert {len(preview.particles) for preview in previews[3].values()} == {0}


def test_a_close_up_shows_particles_ellipse_and_truth_where_they_are(ran, small):
    results = read_run(ran(small))
    assembly = Assembly(results.scenario)
    previews = told_again(results, assembly, [3], lambda _: None)
    camera, preview = assembly.cameras["A"], previews[3]["A"]
    image = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR)
    found = stills._found(results, "A", 3)
    view = stills._View(camera, results.scenario.target, np.zeros(2), 1.0)
    positions = {kind: each.mean[:2] for kind, each in found.items()}

    part = stills._close_up(image, preview, found, positions, view, 200)

    # all of the 2σ ellipse and of the particles, which are drawn in their colour
    assert part.shape == (200, 200, 3)
    orange = np.abs(part.astype(int) - bgr(PARTICLE)).max(axis=2) < 60
    assert orange.sum() > 30
    rim = ellipse(found["dcpf"].mean[:2], found["dcpf"].covariance[:2, :2])
    pixels, _ = camera.project(np.column_stack([rim, np.zeros(len(rim))]))
    np.testing.assert_allclose(view.ellipse(found["dcpf"])[:-1], pixels, atol=1e-9)


def test_pictures_become_smaller_where_there_are_too_many(ran, small, monkeypatch):
    results = read_run(ran(small))
    assembly = Assembly(results.scenario)
    why = choose_moments(results)
    previews = told_again(results, assembly, why, lambda _: None)
    monkeypatch.setattr(stills, "_MIN_WIDTH_PX", 60)

    moments = moments_of(results, assembly, previews, why, limit_bytes=40_000)

    pictures = [still for moment in moments for still in moment.stills]
    assert sum(len(each.source) for each in pictures) <= 40_000
    assert len({each.width_px for each in pictures}) == 1


def test_a_run_in_the_image_plane_has_pixels_and_no_map(dcpf, ran, page, tmp_path):
    scenario = tmp_path / "one.yaml"
    scenario.write_text(textwrap.dedent(ONE), encoding="utf-8")
    folder = ran(scenario)
    assert dcpf("report", folder).exit_code == 0
    read = page(folder / "report.html")
    assert "RMSE / px" in read.source
    assert " / m<" not in read.source
    assert "from above" not in read.source
    assert "How the network agreed" not in read.source
    assert ">CPF<" not in read.source


def test_a_run_without_truth_has_no_errors(dcpf, ran, small, page):
    folder = ran(small)
    # what a run of footage without ground truth leaves behind
    (folder / "truth.jsonl").write_text("", encoding="utf-8")
    (folder / "summary.json").unlink()
    assert dcpf("report", folder).exit_code == 0
    read = page(folder / "report.html")
    assert "Nobody knows the truth" in read.text()
    assert set(read.rows("Errors over frames")["DCPF, all nodes"]) == {"–"}
    assert "Position error" not in read.source
    assert "truth, dashed" not in read.source


def test_a_run_that_was_cut_off_tells_what_is_there(dcpf, ran, small, page):
    folder = ran(small)
    (folder / "summary.json").unlink()
    lines = (folder / "estimates.jsonl").read_text().splitlines(keepends=True)
    kept = [line for line in lines if json.loads(line)["frame"] < 4]
    (folder / "estimates.jsonl").write_text("".join(kept) + lines[-1][:50])
    assert dcpf("report", folder).exit_code == 0
    read = page(folder / "report.html")
    assert "interrupted: 4 of 6 frames are there" in read.text()
    assert "What each link carries" not in read.source


def test_a_recording_gives_the_same_pictures_as_the_run_told_again(dcpf, small, page, tmp_path):
    folder = tmp_path / "filmed"
    assert dcpf("run", small, "--in-process", "--record", "--out", folder).exit_code == 0
    assert dcpf("report", folder).exit_code == 0
    again = tmp_path / "again"
    shutil.copytree(folder, again)
    (again / "run.mcap").unlink()
    assert dcpf("report", again).exit_code == 0
    assert page(folder / "report.html").source == page(again / "report.html").source


def test_a_recording_alone_tells_what_the_folder_tells(dcpf, small, page, tmp_path):
    folder = tmp_path / "filmed"
    assert dcpf("run", small, "--in-process", "--record", "--out", folder).exit_code == 0
    assert dcpf("report", folder).exit_code == 0
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(folder / "run.mcap", alone / "mine.mcap")

    result = dcpf("report", alone / "mine.mcap")

    assert result.stdout.strip() == str(alone / "report.html")
    read, whole = page(alone / "report.html"), page(folder / "report.html")
    for caption in ("Errors over frames", "What each link carries"):
        assert read.rows(caption) == whole.rows(caption)
    assert [image.get("src") for image in read.all("img")] == [image.get("src") for image in whole.all("img")]
    assert read.text("pre") == whole.text("pre")
    assert not [each for each in read.all("p") if each.get("class") == "note"]


def test_of_a_recording_that_was_cut_off_there_is_what_is_there(dcpf, small, page, tmp_path):
    folder = tmp_path / "filmed"
    assert dcpf("run", small, "--in-process", "--record", "--out", folder).exit_code == 0
    whole = (folder / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(0.7 * len(whole))])

    assert dcpf("report", cut).exit_code == 0

    read = page(tmp_path / "report.html")
    assert "interrupted" in read.text()
    assert "What each link carries" not in read.source
    cut.write_bytes(b"no recording")
    refused = dcpf("report", cut)
    assert refused.exit_code == 2
    assert "is no recording of a run" in refused.stderr


def test_what_files_say_is_text(dcpf, ran, small, page):
    folder = ran(small)
    summary = json.loads((folder / "summary.json").read_text())
    summary |= {"died": [HOSTILE], "versions": {HOSTILE: HOSTILE}}
    (folder / "summary.json").write_text(json.dumps(summary))
    with (folder / "scenario.yaml").open("a") as file:
        file.write(f"# </pre>{HOSTILE}\n")
    assert dcpf("report", folder).exit_code == 0
    read = page(folder / "report.html")
    assert read.text().count(HOSTILE) == 4
    assert not re.search(r"<script|<img src=x", read.source)


def test_mistakes_are_one_sentence(dcpf, ran, small, tmp_path):
    assert "is not the folder of a run" in dcpf("report", tmp_path).stderr
    folder = ran(small)
    (folder / "summary.json").write_text("{")
    broken = dcpf("report", folder)
    assert broken.exit_code == 2
    assert "is no summary of a run" in broken.stderr
    (folder / "estimates.jsonl").write_text("")
    empty = dcpf("report", folder)
    assert empty.exit_code == 2
    assert "has no estimates yet" in empty.stderr


def test_moments_are_the_ends_the_middle_and_the_worst(ran, small):
    results = read_run(ran(small))
    moments = choose_moments(results)
    assert set(moments) >= {1, 2, 5}
    assert list(moments) == sorted(moments)
    worst = max(range(1, 6), key=lambda k: max(results.errors(t)[k - 1] for t in results.of("dcpf").values()))
    assert worst in moments
    assert set(choose_moments(Results(results.scenario, tracks=results.tracks))) == {1, 2, 5}


ONE = """
    name: one
    frames: 6
    rate_hz: 10
    target:
      space: image
      person: ann
      size_px: [9, 25]
      start: {velocity: [8.0, 0.0]}
    cameras:
      - {name: A, position: [0, -3, 1.4], look_at: [0, 3, 0.9], focal_px: 120, size_px: [160, 120]}
    filter:
      n_particles: 60
    baselines: {cpf: false}
    world:
      people:
        - name: ann
          path:
            - {time_s: 0.0, position: [-0.8, 3.0]}
            - {time_s: 4.0, position: [0.8, 3.0]}
      room: {center: [0.0, 2.0], size: [16.0, 16.0], height: 4.0}
    """
