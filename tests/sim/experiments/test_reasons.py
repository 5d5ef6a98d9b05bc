"""Why claims do not hold: each sentence is said where made-up runs give it its reason, and nowhere else."""

import numpy as np
import pytest

from sim.experiments.found.claims import judge

from .conftest import N_FRAMES, found

FLAT = {"kind": "flat"}
WITHIN = {"kind": "within", "percent": 5.0, "from_value": 1}
NOISIER = {"kind": "noisier"}
LATE = np.arange(N_FRAMES) >= 6
NOISE = np.random.default_rng(0).normal(size=(2, 2, 20))
CHANCE = {
    FLAT["kind"]: "cannot tell it from chance",
    WITHIN["kind"]: "cannot tell it from chance",
    NOISIER["kind"]: "runs cannot tell: ",
}


def why(small, claim, errors, **more):
    (told,) = judge(found(small, claim, errors, **more))
    assert told.holds is False
    return told.text.partition("Why: ")[2]


def test_of_one_run_nothing_is_told_from_chance(small):
    for claim in (FLAT, WITHIN):
        text = why(small, claim, lambda t, _n, _s: (0.1 * t, 0.1, 0.3, 0.4 - 0.01 * t), runs=1)
        assert text.startswith("One run cannot tell it from chance.")


@pytest.mark.parametrize(("spread", "is_chance"), [(0.5, True), (0.01, False)])
def test_chance_is_what_the_interval_allows(small, spread, is_chance):
    def errors(t, _n, seed):
        noise = spread * (1 if seed % 2 else -1)
        return (0.6 + (0.1 + noise) * (t > 1), 0.5, 0.3, 0.2 + 0.1 * (t > 1))

    assert (CHANCE["flat"] in why(small, FLAT, errors, runs=6)) is is_chance
    assert (CHANCE["within"] in why(small, WITHIN, errors, runs=6)) is is_chance


@pytest.mark.parametrize(("single", "said"), [(0.02, True), (0.2, False)])
def test_single_cameras_that_are_flat_themselves(small, single, said):
    text = why(small, FLAT, lambda t, _n, _s: (0.1 + 0.3 * (t > 1), 0.1, 0.5, 0.5 + single * (t > 1)))

    # two cameras of 0.5 m, of which one changes
    share = f"their errors change by {single / 2 / (0.5 + single / 4):.0%}."
    assert ("hardly depend on it themselves" in text) is said
    assert (share in text) is said


@pytest.mark.parametrize(
    ("losers", "sentence"),
    [
        (
            {1, 2},
            "loses the target in 2 of 4 runs at network.iterations = 12, filter.n_particles = 300, in 0 at",
        ),
        (set(), None),
    ],
)
def test_losses_and_what_is_left_without_them(small, losers, sentence):
    def errors(t, n, seed):
        lost = 2.0 * LATE if seed in losers and (t, n) == (12, 300) else 0.0
        return 0.1 + 0.2 * (t > 1) + lost, 0.1, 0.5, 0.3

    text = why(small, FLAT, errors, runs=4)

    assert (str(sentence) in text) is bool(losers)
    assert ("over the runs that never lose it, 2, it changes by 0.200 m." in text) is bool(losers)


def test_where_every_run_is_lost_somewhere_nothing_is_left(small):
    text = why(small, FLAT, lambda t, _n, _s: (0.1 + 2.0 * (t > 1), 0.1, 0.5, 0.3))

    assert "in 3 of 3 runs at network.iterations = 12" in text
    assert "never lose it" not in text


@pytest.mark.parametrize(
    ("cpf", "sentence"),
    [(0.2, "not the network's doing: CPF changes by 0.200 m, too."), (0.1, ". CPF changes by 0.100 m only.")],
)
def test_whether_cpf_changes_too(small, cpf, sentence):
    text = why(small, FLAT, lambda t, _n, _s: (0.1 + 0.3 * (t > 1), 0.1 + cpf * (t > 1), 0.5, 0.3))

    assert sentence in text


@pytest.mark.parametrize(("grown", "frame"), [(LATE, 6), (np.ones(N_FRAMES), 1), (~LATE, None)])
def test_from_which_frame_on_the_error_has_grown(small, grown, frame):
    text = why(small, FLAT, lambda t, _n, _s: (0.1 + 0.3 * grown * (t > 1), 0.1, 0.5, 0.3))

    assert (f"from frame {frame} to the end" in text) is (frame is not None)
    assert ("to the end" in text) is (frame is not None)


@pytest.mark.parametrize("lost_by_cpf", [False, True])
def test_losses_that_cpf_has_not(small, lost_by_cpf):
    def errors(_t, _n, seed):
        lost = 2.0 * LATE * (seed == 0)
        return 0.2 + lost, 0.1 + lost * lost_by_cpf, 0.5, 0.5

    text = why(small, WITHIN, errors)

    sentence = "DCPF loses the target in 1 of 3 runs, CPF in 0; where neither does, the ratio is 2.00."
    assert (sentence in text) is not lost_by_cpf
    assert ("loses" in text) is not lost_by_cpf


@pytest.mark.parametrize(
    ("falls", "sentence"),
    [
        (0.0, "More does not help: from network.iterations = 1 to 12, DCPF's error changes by 0%."),
        (0.1, "More helps: from network.iterations = 1 to 12, DCPF's error changes by -10%."),
        (-0.1, "More does not help: from network.iterations = 1 to 12, DCPF's error changes by 10%."),
    ],
)
def test_whether_more_rounds_help(small, falls, sentence):
    text = why(small, WITHIN, lambda t, _n, _s: (0.2 * (1 - falls * (t > 1)), 0.1, 0.5, 0.5))

    assert sentence in text


def test_of_one_number_of_rounds_nobody_knows_whether_more_help(small):
    text = why(small, {**WITHIN, "from_value": 12}, lambda *_: (0.2, 0.1, 0.5, 0.5))

    assert "help" not in text


@pytest.mark.parametrize(("disagreement", "said"), [(0.01, True), (0.06, False), (None, False)])
def test_nodes_that_agree_on_something_else(small, disagreement, said):
    text = why(small, WITHIN, lambda *_: (0.2, 0.1, 0.5, 0.5), disagreement=disagreement)

    sentence = "farther off: they differ by 0.010 m, and CPF's error is 0.100 m less."
    assert (sentence in text) is said
    assert ("they differ" in text) is said


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_how_often_the_ratio_was_no_density(small, share):
    text = why(small, WITHIN, lambda *_: (0.2, 0.1, 0.5, 0.5), indefinite=share)

    assert ("In 60% of the local results, the ratio of Eq. 17 was no density." in text) is (share > 0)


@pytest.mark.parametrize(("few", "many", "is_chance"), [(0.010, 0.014, True), (0.002, 0.020, False)])
def test_deviations_that_are_alike_by_chance(small, few, many, is_chance):
    # a different draw for each number of particles
    def errors(t, n, seed):
        noise = NOISE[int(n == 300), int(t > 1), seed]
        return 0.2 + (few if n == 300 else many) * noise, 0.1, 0.5, 0.5

    text = why(small, NOISIER, errors, runs=20)

    assert (CHANCE["noisier"] in text) is is_chance
    assert "Runs of the same seed do not go together (correlation " in text
    assert "which is not less with 500." in text


def test_noise_that_the_pictures_make(small):
    text = why(
        small,
        NOISIER,
        lambda t, n, s: (0.2 + (0.01 if n == 300 else 0.02) * NOISE[0, int(t > 1), s], 0.1, 0.5, 0.5),
        runs=20,
    )

    assert "Runs of the same seed go together (correlation 1.00)" in text
    assert CHANCE["noisier"] not in text  # whichever runs are drawn, the one is half of the other


def test_deviations_without_the_runs_that_lose_the_target(small):
    def errors(_t, n, seed):
        lost = 2.0 * LATE * (seed == 3 and n == 500)
        return 0.2 + (0.02 if n == 300 else 0.01) * seed + lost, 0.1, 0.5, 0.5

    text = why(small, NOISIER, errors, runs=4)

    # of 0, 1, 2 times 0.02 and 0.01
    sentence = "in 1 of 4 runs, at one setting at least; without these it deviates by 0.0200 and 0.0100 m."
    assert sentence in text
