"""The figures of many runs, by hand."""

import pytest

from sim.experiments.found.figures import compare


def summary(dcpf, cpf, singles, *, lost=False, anees=1.0):
    """As much of a run's summary as a comparison reads."""
    return {
        "rmse_m": {"dcpf": dcpf, "cpf": cpf, "single": singles},
        "ratio_dcpf_cpf": dcpf / cpf if cpf else None,
        "lost": {"dcpf": lost, "cpf": False},
        "disagreement_m": 0.01,
        "tracking": {"dcpf": {"ospa_m": dcpf, "reacquired_after_s": None}, "cpf": None},
        "anees": {"dcpf": anees, "cpf": None},
        "network": {"bytes_per_frame": {"dcpf": 6144.0, "cpf": 3686496.0}},
        "fusion": {"indefinite_local_fraction": 0.0},
    }


def test_figures_are_medians_with_the_best_and_the_worst():
    runs = [
        summary(0.1, 0.1, {"A": 0.4, "B": 0.2}),
        summary(0.3, 0.1, {"A": 0.3, "B": None}),
        summary(0.2, 0.4, {"A": 0.8, "B": 0.9}, lost=True),
    ]

    figures = compare(runs, 2)

    assert figures["runs"] == 3
    assert figures["rmse_m"]["dcpf"] == {"median": 0.2, "min": 0.1, "max": 0.3}
    assert figures["rmse_m"]["cpf"] == {"median": 0.1, "min": 0.1, "max": 0.4}
    assert figures["rmse_m"]["best_single"] == {"median": 0.3, "min": 0.2, "max": 0.8}
    # Ratios are taken run by run, since the runs are paired by their seed.
    assert figures["ratio_dcpf_cpf"] == pytest.approx({"median": 1.0, "min": 0.5, "max": 3.0})
    assert figures["ratio_dcpf_best_single"] == pytest.approx({"median": 0.5, "min": 0.25, "max": 1.0})
    assert figures["lost_fraction"] == {"dcpf": pytest.approx(1 / 3), "cpf": 0}
    assert figures["anees"]["cpf"] is None
    assert figures["mean_rmse_m"]["dcpf"]["mean"] == pytest.approx(0.2)
    assert figures["mean_rmse_m"]["dcpf"]["deviation"] == pytest.approx(0.1)
    assert figures["tracking"]["dcpf"]["ospa_m"] == {"median": 0.2, "min": 0.1, "max": 0.3}
    assert figures["tracking"]["dcpf"]["reacquired_after_s"] is None
    assert figures["tracking"]["cpf"] is None
    assert figures["bytes_per_frame"]["dcpf"] == 6144


def test_without_baselines_or_truth_there_is_nothing_to_compare():
    run = summary(0.1, None, {})
    run["lost"]["cpf"] = None  # as where no CPF ran

    figures = compare([run], 2)

    assert figures["lost_fraction"] == {"dcpf": 0, "cpf": None}
    assert figures["rmse_m"]["cpf"] is None
    assert figures["rmse_m"]["best_single"] is None
    assert figures["ratio_dcpf_cpf"] is None
    assert figures["ratio_dcpf_best_single"] is None
