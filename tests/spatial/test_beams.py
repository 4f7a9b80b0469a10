from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from drivetrain.errors import InputError
from drivetrain.spatial.beams import Beam, Section, beam_compliance, box_tube, end_deflection, round_tube

SECTION = Section(bending_x=3.0e3, bending_y=5.0e3, torsion=2.0e3, axial=4.0e7)
L = 0.7


def hanging(force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0)):
    """Wrenches at start and end of a massless beam with this force and moment on its end."""
    force, moment = -np.asarray(force), -np.asarray(moment)
    start = moment + np.cross([0.0, 0.0, L], force)
    return np.concatenate([start, force]), np.concatenate([moment, force])


def test_textbook_cantilever() -> None:
    f, m = 90.0, 13.0
    x, y = SECTION.bending_x, SECTION.bending_y
    cases = {
        # A force along +y moves the end along +y and rotates it about -x.
        (0, f, 0, 0, 0, 0): [-f * L**2 / (2 * x), 0, 0, 0, f * L**3 / (3 * x), 0],
        (f, 0, 0, 0, 0, 0): [0, f * L**2 / (2 * y), 0, f * L**3 / (3 * y), 0, 0],
        (0, 0, f, 0, 0, 0): [0, 0, 0, 0, 0, f * L / SECTION.axial],
        (0, 0, 0, m, 0, 0): [m * L / x, 0, 0, 0, -m * L**2 / (2 * x), 0],
        (0, 0, 0, 0, m, 0): [0, m * L / y, 0, m * L**2 / (2 * y), 0, 0],
        (0, 0, 0, 0, 0, m): [0, 0, m * L / SECTION.torsion, 0, 0, 0],
    }
    compliance = beam_compliance(SECTION, L)
    for load, expected in cases.items():
        wrench = np.array([*load[3:], *load[:3]], dtype=float)
        np.testing.assert_allclose(compliance @ wrench, expected, rtol=1e-14, atol=1e-18)
        np.testing.assert_allclose(
            end_deflection(SECTION, L, *hanging(load[:3], load[3:])), expected, rtol=1e-13, atol=1e-17
        )


def test_many_loads_at_once_are_the_compliance() -> None:
    rng = np.random.default_rng(3)
    loads = rng.normal(size=(20, 6)) * 50.0
    pairs = [hanging(load[3:], load[:3]) for load in loads]
    found = end_deflection(SECTION, L, *(np.array(side) for side in zip(*pairs, strict=True)))
    np.testing.assert_allclose(found, loads @ beam_compliance(SECTION, L), rtol=1e-12, atol=1e-16)


def test_compliance_is_short_springs_in_series() -> None:
    pieces = 400
    total = np.zeros((6, 6))
    local = np.diag(L / pieces / np.array([*vars(SECTION).values()]))
    spring = np.zeros((6, 6))
    spring[:3, :3], spring[5, 5] = local[:3, :3], local[3, 3]
    for k in range(pieces):
        lever = L - (k + 0.5) * L / pieces
        carry = np.eye(6)
        carry[3, 1], carry[4, 0] = lever, -lever
        total += carry @ spring @ carry.T
    # The error of the midpoint rule is 1/(4 pieces^2) of the L^3 terms.
    np.testing.assert_allclose(total, beam_compliance(SECTION, L), rtol=1e-5, atol=1e-15)


def test_own_weight() -> None:
    w = 120.0  # N/m along -y
    start = np.array([w * L**2 / 2 * -1.0, 0, 0, 0, w * L, 0])
    found = end_deflection(SECTION, L, start, np.zeros(6))
    assert found[4] == pytest.approx(-w * L**4 / (8 * SECTION.bending_x), rel=1e-13)
    assert found[0] == pytest.approx(w * L**3 / (6 * SECTION.bending_x), rel=1e-13)


def test_load_that_grows_towards_the_end() -> None:
    # 11 w L^4/(120 E I) for a triangular load with w at the free end; its resultant w L/2 acts at 2 L/3.
    w = 200.0
    start = np.array([-w * L / 2 * 2 * L / 3, 0, 0, 0, w * L / 2, 0])
    found = end_deflection(SECTION, L, start, np.zeros(6))
    assert found[4] == pytest.approx(-11 * w * L**4 / (120 * SECTION.bending_x), rel=1e-13)


def test_point_mass_counted_as_own_load() -> None:
    # The 10 % in the docstring: 0.3 instead of 1/3.
    p = 10.0
    start, _ = hanging((0.0, -p, 0.0))
    found = end_deflection(SECTION, L, start, np.zeros(6))
    assert found[4] / (-p * L**3 / (3 * SECTION.bending_x)) == pytest.approx(0.9, rel=1e-12)


def test_any_line_load_by_quadrature() -> None:
    a, b = 35.0, -80.0  # N/m along x: a + b s/L
    start = np.zeros(6)
    start[3] = -(a + b / 2) * L
    start[1] = -quad(lambda s: s * (a + b * s / L), 0, L)[0]
    deflection = quad(lambda s: (a + b * s / L) * s**2 * (3 * L - s) / (6 * SECTION.bending_y), 0, L)[0]
    assert end_deflection(SECTION, L, start, np.zeros(6))[3] == pytest.approx(deflection, rel=1e-12)


def test_sections() -> None:
    tube = round_tube(0.05, 0.04, 70e9, 26e9)
    second = math.pi / 4 * (0.025**4 - 0.02**4)
    np.testing.assert_allclose(
        [*vars(tube).values()],
        [70e9 * second, 70e9 * second, 26e9 * 2 * second, 70e9 * math.pi * (0.025**2 - 0.02**2)],
        rtol=1e-13,
    )
    box = box_tube(0.08, 0.05, 0.003, 70e9, 26e9)
    assert box.bending_y > box.bending_x  # wider than high: stiffer about the vertical axis
    assert box.axial == pytest.approx(70e9 * (0.08 * 0.05 - 0.074 * 0.044), rel=1e-13)
    square = box_tube(0.06, 0.06, 0.002, 70e9, 26e9)
    # Bredt on a square: t a^3 with a the side of the middle line.
    assert square.torsion == pytest.approx(26e9 * 0.002 * 0.058**3, rel=1e-12)


def test_box_tube_is_the_integral_over_its_walls() -> None:
    """Second moments about x and y of what is steel, by the integral of the width at each height."""
    width, height, wall = 0.08, 0.05, 0.003
    box = box_tube(width, height, wall, 70e9, 26e9)

    def second(across: float, along: float) -> float:
        def steel(z: float) -> float:
            return across if abs(z) > along / 2 - wall else 2 * wall

        return quad(lambda z: steel(z) * z**2, -along / 2, along / 2, points=[-along / 2 + wall, along / 2 - wall])[0]

    assert box.bending_x == pytest.approx(70e9 * second(width, height), rel=1e-12)
    assert box.bending_y == pytest.approx(70e9 * second(height, width), rel=1e-12)
    middle = (width - wall) * (height - wall)  # Bredt, second formula: 4 A^2 / the integral of ds/t
    assert box.torsion == pytest.approx(26e9 * 4 * middle**2 / (2 * (width + height - 2 * wall) / wall), rel=1e-12)


def test_axes_of_a_beam() -> None:
    plain = Beam(SECTION, np.zeros(3), np.array([0.0, 0.0, 2.0]))
    np.testing.assert_array_equal(plain.axes, np.eye(3))
    turned = Beam(SECTION, np.array([1.0, 0, 0]), np.array([1.0, 3.0, 0]), side=np.array([0.2, 5.0, 1.0]))
    axes = turned.axes
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes[:, 2], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(axes[:, 0], np.array([0.2, 0.0, 1.0]) / math.hypot(0.2, 1.0), rtol=1e-14, atol=1e-16)
    assert turned.length == 3.0


def test_bad_input() -> None:
    with pytest.raises(InputError) as caught:
        Section(1.0, -1.0, 0.0, float("nan"))
    assert [fault.place for fault in caught.value.faults] == ["section.bending_y", "section.torsion", "section.axial"]
    with pytest.raises(InputError, match="differ from its start"):
        Beam(SECTION, np.ones(3), np.ones(3))
    with pytest.raises(InputError, match="beam's own direction"):
        Beam(SECTION, np.zeros(3), np.ones(3), side=-2.0 * np.ones(3))
    with pytest.raises(InputError, match=r"round_tube\.inner"):
        round_tube(0.04, 0.05, 1.0, 1.0)
    with pytest.raises(InputError, match=r"box_tube\.wall"):
        box_tube(0.04, 0.05, 0.02, 1.0, 1.0)
