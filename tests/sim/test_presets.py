"""Presets: they fill what a file leaves unsaid, and nothing else."""

import pytest

from network.averaging.weights import ConstantWeights, MetropolisWeights
from sim.scenario.loading import load_scenario
from sim.scenario.presets import ONE_CAMERA, PAPER, PAPER_ON_ARRAY, PERSON_PARTS, ROBUST, preset_defaults

CONSTANT = ("network.consensus", "{algorithm: constant, epsilon: 0.2}")


def test_the_robust_preset_is_the_one_where_none_is_named(small):
    unsaid = load_scenario(small)
    named = load_scenario(small, [("preset", "robust")])

    assert unsaid == named
    assert unsaid.fusion.rule == "quadratic_fit"
    assert isinstance(unsaid.network.consensus, MetropolisWeights)


def test_the_paper_preset_is_the_paper(small):
    paper = load_scenario(small, [("preset", "paper"), ("network.iterations", "12")])

    assert paper.fusion.rule == "eq17"
    assert paper.fusion.local_particles == "own"
    assert paper.filter.color.space == "rgb"
    assert paper.filter.color.bins_per_channel == 8
    assert paper.network.consensus == ConstantWeights(epsilon=0.325)


@pytest.mark.parametrize("preset", ["paper", "robust"])
def test_what_the_file_says_wins(small, preset):
    chosen = load_scenario(
        small, [("preset", preset), ("fusion.proposal", "prior"), ("filter.color.bins_per_channel", "5")]
    )

    assert chosen.filter.n_particles == 40
    assert chosen.network.iterations == 3
    assert chosen.fusion.proposal == "prior"
    assert chosen.filter.color.bins_per_channel == 5


def test_another_algorithm_leaves_the_presets_epsilon_behind(small):
    chosen = load_scenario(small, [("preset", "paper"), ("network.consensus", "{algorithm: metropolis}")])

    assert chosen.network.consensus == MetropolisWeights()
    assert chosen.fusion.rule == "eq17"


def test_another_epsilon_alone_keeps_the_presets_algorithm(small):
    chosen = load_scenario(small, [("preset", "paper"), ("network.consensus.epsilon", "0.2")])

    assert chosen.network.consensus == ConstantWeights(epsilon=0.2)


def test_the_robust_preset_takes_another_algorithm_with_its_options(small):
    assert load_scenario(small, [CONSTANT]).network.consensus == ConstantWeights(epsilon=0.2)


def test_only_a_person_has_head_torso_and_legs():
    assert preset_defaults({})["filter"]["color"]["parts"] == PERSON_PARTS["filter"]["color"]["parts"]
    assert preset_defaults({"target": {"space": "volume"}}) == ROBUST
    assert preset_defaults({"preset": "paper"}) == PAPER


def test_the_paper_preset_counts_every_pixel_but_on_the_array(small):
    paper, on_array = ("preset", "paper"), ("filter.backend", "simd")

    def grid(*overrides):
        return load_scenario(small, overrides).filter.sampling.grid

    assert grid(paper) is None
    assert grid(paper, on_array) == tuple(PAPER_ON_ARRAY["filter"]["sampling"]["grid"])
    assert grid(paper, on_array, ("filter.sampling.grid", "[7, 9]")) == (7, 9)
    assert grid(on_array) == grid()


@pytest.mark.parametrize("preset", ["paper", "robust"])
def test_in_the_image_plane_both_presets_begin_with_pixels_and_a_person_is_one_part(preset):
    data = {"preset": preset, "target": {"space": "image"}}
    filled = preset_defaults(data)

    assert filled["target"] == ONE_CAMERA["target"]
    assert filled["filter"]["dynamics"] == ONE_CAMERA["filter"]["dynamics"]
    assert filled["filter"]["color"].get("parts", [1.0]) == [1.0]
    assert filled["fusion"]["rule"] == {"paper": "eq17", "robust": "net_information"}[preset]
    # the papers' trackers: a Gaussian in the distance, resampling in every frame
    literal = filled["filter"]["likelihood"].get("form") == "literal"
    assert literal == (filled["filter"].get("resampling") == {"threshold": 1.0}) == (preset == "paper")


@pytest.mark.parametrize(
    "broken",
    [
        {"preset": 3},
        {"preset": "none"},
        {"target": []},
        {"network": "ring"},
        {"preset": "paper", "filter": 3},
    ],
)
def test_a_broken_scenario_is_left_to_the_model_to_judge(broken):
    assert isinstance(preset_defaults(broken), dict)


def test_presets_are_not_changed_by_what_is_merged(small):
    before = repr((PAPER, ROBUST, PERSON_PARTS))

    load_scenario(small, [("preset", "paper"), ("filter.n_particles", "7")])
    load_scenario(small, [("filter.color.bins_per_channel", "7")])

    assert repr((PAPER, ROBUST, PERSON_PARTS)) == before
