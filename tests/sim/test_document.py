"""Scenario files: every mistake is answered with its place and the remedy."""

import string
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, model_validator

from network.options import Options
from sim.scenario import parsing
from sim.scenario.complaints import validate
from sim.scenario.document import dump, merge_defaults, read_document
from sim.scenario.parsing import ScenarioError


class Panel(Options):
    kind: Literal["panel"]
    width: float = Field(default=1.0, gt=0)


class Pillar(Options):
    kind: Literal["pillar"]
    radius: float


class Lens(Options):
    name: str = Field(min_length=1)
    focal_px: float = Field(gt=0)
    size_px: tuple[int, int] = (640, 480)


class Chart(Options):
    file: str


class Filter(Options):
    n_particles: int = Field(default=500, ge=1)
    sigma: float | Literal["auto"] = "auto"
    resampling: Literal["systematic", "residual"] = "systematic"
    inner: bool = False

    @model_validator(mode="after")
    def _lucky(self):
        if self.n_particles == 13:
            raise ValueError("13 particles bring bad luck: take 14")
        return self


class Toy(Options):
    name: str
    rate_hz: float = 10.0
    filter: Filter = Filter()
    cameras: list[Lens] = Field(min_length=1)
    things: tuple[Annotated[Panel | Pillar, Field(discriminator="kind")], ...] = ()
    view: Lens | Chart | None = None

    @model_validator(mode="after")
    def _enough(self):
        if self.rate_hz > 1000:
            raise ValueError("no camera is that fast: lower rate_hz")
        return self


BASE = """\
name: toy
cameras:
  - {name: C1, focal_px: 500}
  - name: C2
    focal_px: 1e-3
"""


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Writes ``toy.yaml`` and reads it."""
    monkeypatch.chdir(tmp_path)

    def write(text):
        path = Path("toy.yaml")
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_document(path)

    return write


def complaints(call, *arguments):
    with pytest.raises(ScenarioError) as raised:
        call(*arguments)
    return str(raised.value).splitlines()


def test_a_good_file_becomes_its_model(written):
    toy = validate(written(BASE + "things: [{kind: pillar, radius: 2}]\nview: {file: a}\n"), Toy)
    assert toy == Toy(
        name="toy",
        cameras=[Lens(name="C1", focal_px=500.0), Lens(name="C2", focal_px=0.001)],
        things=(Pillar(kind="pillar", radius=2.0),),
        view=Chart(file="a"),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("filter:\n  n_particle: 3", "7:3: filter.n_particle is not a key here: did you mean n_particles?"),
        ("N_AME: 3", "6:1: N_AME is not a key here: did you mean name?"),
        ("view: {file: a, xyz: 3}", "6:17: view.xyz is not a key here: the keys are file"),
        ("filter: {n_particles: many}", '6:10: filter.n_particles must be a whole number, got "many"'),
        ("filter: {n_particles: 1e3}", "6:10: filter.n_particles must be a whole number, got 1000.0"),
        ("filter: {n_particles: true}", "6:10: filter.n_particles must be a whole number, got true"),
        ("filter: {n_particles: 0}", "6:10: filter.n_particles must be greater than or equal to 1, got 0"),
        ("filter: {inner: yes}", '6:10: filter.inner must be true or false, got "yes"'),
        ("filter: {sigma: [1]}", "6:10: filter.sigma must be a number or 'auto', got a list of 1"),
        ("filter: {n_particles: 13}", "6:1: filter: 13 particles bring bad luck: take 14"),
        ("filter:", "6:1: filter must be a group of keys, got nothing"),
        (
            "filter: {resampling: systematik}",
            (
                "6:10: filter.resampling must be 'systematic' or 'residual', "
                'got "systematik": did you mean systematic?'
            ),
        ),
        ("rate_hz: '10'", '6:1: rate_hz must be a number, got "10"'),
        ("things: 5", "6:1: things must be a list, got 5"),
        (
            "things: [{kind: panl}]",
            """6:10: things[0].kind must be one of 'panel', 'pillar', got "panl": did you mean panel?""",
        ),
        ("things: [{width: 1}]", "6:10: things[0].kind is missing: add it"),
        ("things: [{kind: pillar}]", "6:10: things[0].radius is missing: add it"),
        (
            "things: [{kind: panel, radus: 1}]",
            "6:24: things[0].radus is not a key here: the keys are kind, width",
        ),
        ("view: {name: '', focal_px: 3}", '6:8: view.name must have at least 1 character, got ""'),
        ("view: {name: C9, focal_px: 3, size_px: [640]}", "6:31: view.size_px[1] is missing: add it"),
        (
            "view: {name: C9, focal_px: 3, size_px: [1, 2, 3]}",
            "6:31: view.size_px must have at most 2 items, got a list of 3",
        ),
        ("view: 3", "6:1: view must be a group of keys, got 3"),
    ],
)
def test_each_mistake_gets_one_line_with_place_and_remedy(written, text, message):
    assert complaints(validate, written(BASE + text), Toy) == [f"toy.yaml:{message}"]


def test_a_key_missing_at_the_top_names_the_file(written):
    assert complaints(validate, written("name: toy"), Toy) == ["toy.yaml: cameras is missing: add it"]


@pytest.mark.parametrize(
    ("cameras", "message"),
    [
        ("[]", "1: cameras must have at least 1 item, got a list of 0"),
        ("[{name: C1}]", "11: cameras[0].focal_px is missing: add it"),
    ],
)
def test_a_list_is_too_short_by_what_stands_in_it_not_by_what_is_right(written, cameras, message):
    document = written(f"name: toy\ncameras: {cameras}")
    assert complaints(validate, document, Toy) == [f"toy.yaml:2:{message}"]


def test_a_rule_of_the_whole_file_names_the_file(written):
    found = complaints(validate, written(BASE + "rate_hz: 2000"), Toy)
    assert found == ["toy.yaml: no camera is that fast: lower rate_hz"]


def test_several_mistakes_get_a_line_each_and_many_are_counted(written):
    two = complaints(validate, written(BASE + "rate_hz: x\nthings: y"), Toy)
    assert [line.split(" ")[1] for line in two] == ["rate_hz", "things"]
    many = complaints(validate, written(BASE + "things: [" + "5, " * 20 + "]"), Toy)
    assert len(many) == 10
    assert many[-1] == "toy.yaml: and 11 more like these"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "toy.yaml: is empty"),
        ("# only a comment", "toy.yaml: is empty"),
        ("- a", "toy.yaml: must hold keys with values at the top level"),
        (
            "a: 1\nb: {c: 1,\n  c: 2}",
            "toy.yaml:3:3: b.c is here a second time, after toy.yaml:2:5: keep one",
        ),
        ("a: b: c", "toy.yaml:1:5: mapping values are not allowed here"),
        ("a:\n\t- b", "toy.yaml:2:1: while scanning for the next token, found character '\\t'"),
        ("a: *b", "toy.yaml:1:4: found undefined alias 'b'"),
        ("a: 1\n---\nb: 2", "toy.yaml:2:1: expected a single document"),
        ("a: \x01", "toy.yaml: is not YAML: unacceptable character"),
        (b"a: 1\nb: \xff", "toy.yaml:2: is not UTF-8 text"),
        ("a: &b [*b]", "toy.yaml: is nested without end"),
        ("[" * 600, "toy.yaml: is nested without end"),
        ("a: !!python/none x", "toy.yaml:1:4: the tag tag:yaml.org,2002:python/none is not read here"),
        ("b: &b {a: 1}\nc: {<<: *b}", "toy.yaml:2:5: keys must be plain words"),
        ("? [1]\n: 2", "toy.yaml:1:3: keys must be plain words"),
        ("a: " + "9" * 5000, "toy.yaml:1:4: 99999999999999999999... cannot be read as a number"),
    ],
)
def test_what_is_no_scenario_is_refused_in_one_line(written, text, message):
    (line,) = complaints(written, text)
    assert line.startswith(message)


def test_aliases_of_aliases_do_not_unfold_without_end(written, monkeypatch):
    monkeypatch.setattr(parsing, "_MAX_NODES", 40)
    text = "a: &a [1, 1, 1, 1]\nb: &b [*a, *a, *a, *a]\nc: [*b, *b, *b, *b]"
    assert complaints(written, text) == ["toy.yaml: has more than 40 values: use fewer aliases"]


def test_files_that_cannot_be_read_are_named(tmp_path):
    assert "there is no such file" in complaints(read_document, tmp_path / "nowhere.yaml")[0]
    assert "is a folder" in complaints(read_document, tmp_path)[0]


def test_numbers_and_words_are_those_of_yaml_1_2(written):
    data = written("a: 1e-3\nb: yes\nc: 0o17\nd: .inf\ne: 2020-01-01\nf: ~\n7: x\n").data
    assert data == {
        "a": 0.001,
        "b": "yes",
        "c": 15,
        "d": float("inf"),
        "e": "2020-01-01",
        "f": None,
        "7": "x",
    }


def test_anchors_stand_for_what_they_name(written):
    assert written("a: &size [640, 480]\nb: *size\n").data == {"a": [640, 480], "b": [640, 480]}


@pytest.mark.parametrize(
    ("key", "text", "at", "value"),
    [
        ("rate_hz", "25", ("rate_hz",), 25),
        ("filter.n_particles", "7", ("filter", "n_particles"), 7),
        ("cameras.C2.focal_px", "1e2", ("cameras", 1, "focal_px"), 100.0),
        ("cameras.1.focal_px", "5", ("cameras", 1, "focal_px"), 5),
        ("cameras[0].size_px", "[320, 240]", ("cameras", 0, "size_px"), [320, 240]),
        ("cameras.C1", "{name: C7, focal_px: 1}", ("cameras", 0), {"name": "C7", "focal_px": 1}),
        ("view", "", ("view",), None),
    ],
)
def test_an_option_sets_one_value_and_leaves_the_document_alone(written, key, text, at, value):
    document = written(BASE)
    changed = document.with_value(key, text)
    here = changed.data
    for step in at:
        here = here[step]
    assert here == value
    assert changed.place(at) == f"--set {key}={text}"
    assert document.data == written(BASE).data


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("cameras.C9.focal_px", "1", "cameras has no item C9: its items are C1, C2"),
        ("cameras.2", "1", "cameras has no item 2: its items are C1, C2"),
        ("name.first", "x", "name is a single value and has no first: set name itself"),
        ("filter..sigma", "1", "the key has an empty part"),
        ("rate_hz", "[1", "while parsing a flow sequence"),
        ("filter", "{sigma: 1, sigma: 2}", "sigma is here a second time"),
    ],
)
def test_an_option_that_leads_nowhere_is_named(written, key, text, message):
    (line,) = complaints(written(BASE).with_value, key, text)
    assert line.startswith(f"--set {key}={text}: {message}")


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("filtre.n_particles", "5", "filtre is not a key here: did you mean filter?"),
        ("filter.n_particle", "5", "filter.n_particle is not a key here: did you mean n_particles?"),
        ("cameras[1].focal_px", "-1", "cameras[1].focal_px must be greater than 0, got -1"),
        ("view", "{name: C9}", "view.focal_px is missing: add it"),
    ],
)
def test_a_model_names_the_option_that_it_refuses(written, key, text, message):
    document = written(BASE).with_value(key, text)
    assert complaints(validate, document, Toy) == [f"--set {key}={text}: {message}"]


def test_defaults_fill_groups_in_and_the_files_own_keys_win(written):
    document = written("name: toy\nfilter: {sigma: 0.1}\ncameras: [{name: C1}]\nrate_hz: ~")
    defaults = {
        "filter": {"sigma": 9, "n_particles": 7},
        "cameras": [{}, {}],
        "rate_hz": 5,
        "view": {"file": "a"},
    }
    merged = merge_defaults(document, defaults)
    assert merged.data == {
        "name": "toy",
        "filter": {"sigma": 0.1, "n_particles": 7},
        "cameras": [{"name": "C1"}],
        "rate_hz": None,
        "view": {"file": "a"},
    }
    assert merged.place(("filter", "sigma")) == "toy.yaml:2:10"
    assert merged.place(("filter", "n_particles")) == "toy.yaml:2:1"
    assert merged.place(("view", "file")) == "toy.yaml"
    merged.data["view"]["file"] = "b"
    assert defaults["view"] == {"file": "a"}


def test_a_model_is_written_so_that_people_and_the_reader_can_read_it(written, tmp_path):
    toy = validate(written(BASE + "things: [{kind: panel}]"), Toy)
    dump(toy, tmp_path / "again.yaml")
    assert validate(read_document(tmp_path / "again.yaml"), Toy) == toy
    assert (tmp_path / "again.yaml").read_text() == (
        "name: toy\n"
        "rate_hz: 10.0\n"
        "filter:\n"
        "  n_particles: 500\n"
        "  sigma: auto\n"
        "  resampling: systematic\n"
        "  inner: false\n"
        "cameras:\n"
        "  - name: C1\n"
        "    focal_px: 500.0\n"
        "    size_px: [640, 480]\n"
        "  - name: C2\n"
        "    focal_px: 0.001\n"
        "    size_px: [640, 480]\n"
        "things:\n"
        "  - kind: panel\n"
        "    width: 1.0\n"
        "view:\n"
    )


keys = st.text(string.ascii_letters + "_0123456789", min_size=1, max_size=8)
plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text(string.printable + "äΩ語", max_size=20)
    | st.sampled_from(["1e-3", "yes", "~", "null", "0x1f", "2020-01-01", "<<", "a: b", "- c", "# d", " e "]),
    lambda items: (
        st.lists(items, max_size=4)
        | st.dictionaries(
            st.text(string.ascii_letters + "_0123456789", min_size=1, max_size=8), items, max_size=4
        )
    ),
    max_leaves=20,
)


@settings(deadline=None, max_examples=50)
@given(st.dictionaries(keys, plain, min_size=1, max_size=5))
def test_whatever_is_written_is_read_back(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    dump(data, path)
    # The same text, not only equal: 1, 1.0 and true are different things here.
    assert repr(read_document(path).data) == repr(data)
