"""The page of an experiment: what was found, whole or not."""

import json
import re
from contextlib import contextmanager
from pathlib import Path

import pytest

from sim.experiments.computing import engine

SWEEP = ["--sweep", "network.iterations=1:2", "--sweep", "filter.n_particles=10,20"]
BRIEF = ["--frames", "3", "--runs", "2", "--jobs", "1", "--out", "out"]
TITLE = "rounds <script>alert('1')</script> & \"graphs\""


@pytest.fixture
def stopped(monkeypatch):
    """Lets so many parts be computed, and then something happen."""

    @contextmanager
    def stop(n_parts, error):
        compute, done = engine.compute, []

        def count(part, code):
            if len(done) == n_parts:
                raise error
            done.append(part)
            return compute(part, code)

        with monkeypatch.context() as patch:
            patch.setattr(engine, "compute", count)
            yield

    return stop


@pytest.mark.usefixtures("small")
def test_a_report_has_every_study_and_the_summarys_figures(dcpf, page):
    studies = {
        "rounds": {"title": TITLE, "sweep": {"network.iterations": "1:2"}, "claims": [{"kind": "flat"}]},
        "ways": {"plot": "paths"},
        "frames": {"plot": "frames"},
        "bytes": {"plot": "bytes", "sweep": {"network.iterations": [1, 2]}, "jpeg_quality": 90},
        "strips": {"plot": "strips"},
    }
    experiment = {"name": "tiny", "scenarios": ["small.yaml"], "studies": studies}
    Path("tiny.yaml").write_text(json.dumps(experiment), encoding="utf-8")

    result = dcpf("compare", "tiny.yaml", "--set", "filter.n_particles=10", *BRIEF)

    assert result.exit_code == 0
    read = page(Path("out/report.html"))
    assert [heading.text for heading in read.all("h2")] == [
        "What was run",
        TITLE,
        *("ways", "frames", "bytes", "strips"),
        "What the cameras saw in small (robust), seed 0",
    ]
    assert TITLE in read.text()
    assert "is missing" not in read.text()
    (verdict,) = json.loads(Path("out/comparison.json").read_text())["claims"]
    assert verdict["text"] in read.text()
    rows = [row.split(",") for row in Path("out/summary.csv").read_text().splitlines()]
    mean = rows[4][rows[0].index("rmse_mean")]  # of DCPF with two rounds, the table's last
    assert read.rows("small (robust)")["DCPF"][2] == f"{float(mean):.3f}"
    assert len(re.findall("<svg", read.source)) == 1 + len(studies)


def test_a_report_shows_one_run_as_the_runs_own_report_does(dcpf, ran, small, page):
    given = ["--set", "filter.n_particles=10"]
    assert dcpf("compare", small, *given, *BRIEF).exit_code == 0
    folder = ran(small, "--frames", 3, *given)
    assert dcpf("report", folder).exit_code == 0

    shown, own = page(Path("out/report.html")), page(folder / "report.html")

    assert [image.get("src") for image in shown.all("img")] == [image.get("src") for image in own.all("img")]
    assert [image.get("alt") for image in shown.all("img")] == [image.get("alt") for image in own.all("img")]
    assert shown.rows("What each link carries") == own.rows("What each link carries")


def test_it_is_the_run_in_which_least_is_swept(dcpf, small, page):
    assert dcpf("compare", small, *SWEEP, *BRIEF).exit_code == 0

    read = page(Path("out/report.html"))

    assert "With network.iterations = 2, filter.n_particles = 20." in read.text()
    links = read.rows("What each link carries").values()
    assert {cells[1] for cells in links if cells[0] == "rounds"} == {"2"}


@pytest.mark.parametrize(
    ("n_parts", "error", "code"), [(3, KeyboardInterrupt(), 130), (5, OSError(28, "disk"), 2)]
)
def test_of_an_experiment_that_did_not_end_there_is_what_is_there(
    dcpf, small, page, stopped, n_parts, error, code
):
    with stopped(n_parts, error):
        result = dcpf("compare", small, *SWEEP, *BRIEF)

    assert result.exit_code == code
    read = page(Path("out/report.html"))
    assert re.search(r"\d runs are missing", read.text())
    assert read.rows("small (robust)")["DCPF"]
    assert not Path("out/comparison.json").exists()


def test_the_rest_makes_the_same_page_as_if_nothing_had_happened(dcpf, small, stopped):
    assert dcpf("compare", small, *SWEEP, *BRIEF).exit_code == 0
    whole = Path("out/report.html").read_bytes()
    for path in Path("out/parts").iterdir():
        path.unlink()

    with stopped(4, KeyboardInterrupt()):
        assert dcpf("compare", small, *SWEEP, *BRIEF).exit_code == 130
    assert Path("out/report.html").read_bytes() != whole
    assert dcpf("compare", small, *SWEEP, *BRIEF).exit_code == 0
    assert Path("out/report.html").read_bytes() == whole
