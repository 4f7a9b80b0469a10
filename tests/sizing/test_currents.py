"""The current table: complete, its parts add up, and it says where the drive runs out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.drive.amplifier import Amplifier
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.judge.evaluate import evaluate


@pytest.fixture
def evaluation(make):
    return evaluate(make.study(make.sines(2), arm=make.planar_arm([0.3, 0.3], [1.5, 1.0])))


def test_one_row_per_sample_and_joint(evaluation):
    table = current_commands(evaluation)
    samples = len(evaluation.study.cycle.time)
    assert len(table) == 2 * samples
    assert list(table["joint"].unique()) == ["j1", "j2"]
    assert table["joint"].value_counts().eq(samples).all()
    assert not table.isna().any().any()
    assert all("[" in name for name in table.columns if name not in ("joint", "saturated"))


def test_parts_add_up_to_the_command(evaluation):
    table = current_commands(evaluation)
    parts = table[["gear torque current [A]", "rotor inertia current [A]", "friction current [A]"]].sum(axis=1)
    np.testing.assert_allclose(parts, table["current [A]"], atol=1e-12)
    torque = table["current [A]"] / table["motor torque [N m]"]
    for joint in ("j1", "j2"):  # one torque constant a joint, weaker than the cold one
        ratios = torque[(table["joint"] == joint) & (table["motor torque [N m]"].abs() > 1e-6)]
        assert ratios.std() / ratios.mean() < 1e-9
        assert ratios.mean() > 1 / 0.05


def test_phase_currents_heat_as_much(evaluation):
    table = current_commands(evaluation)
    # R I^2 of the DC equivalent is 3 (R / 2) I_rms^2 of the phases; a sine's peak is sqrt(2) of its RMS.
    np.testing.assert_allclose(table["phase current RMS [A]"] ** 2 * 1.5, table["current [A]"] ** 2)
    np.testing.assert_allclose(table["phase current peak [A]"], np.sqrt(2) * table["phase current RMS [A]"])


def test_saturation_is_flagged_where_it_happens(evaluation, make):
    assert not current_commands(evaluation)["saturated"].any()
    study = evaluation.study
    limit = 0.5 * np.abs(evaluation.joints["j1"].series.current).max()
    tasks = tuple(replace(task, amplifier=Amplifier(peak_current=float(limit))) for task in study.joints)
    table = current_commands(evaluate(replace(study, joints=tasks)))
    over = table["current [A]"].abs() > limit
    assert over.any() and not over.all()
    np.testing.assert_array_equal(table["saturated"], over)
