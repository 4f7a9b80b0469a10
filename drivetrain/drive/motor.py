"""The motor: its sheet in SI, and the laws of its shaft and its terminals.

All electrical values are those of the equivalent DC machine between two terminals (for a three-phase motor: block
commutation, line to line), so that torque constant and back-emf constant are one number; the catalogue reader
converts from other conventions and refuses a row that does not state its own.
"""

from __future__ import annotations

from dataclasses import dataclass

COPPER_COEFFICIENT = 0.0039  # 1/K at 25 C, annealed copper


@dataclass(frozen=True)
class Motor:
    """A motor's data sheet; None where the sheet says nothing (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        maker, series, part_number: As printed.
        kind: ``brushed`` or ``brushless``.
        frameless: Sold as rotor and stator, without housing and bearings.
        resistance: Terminal resistance at ``reference_temperature`` [ohm].
        torque_constant: At ``reference_temperature`` [N m/A], equal to the back-emf constant [V s/rad].
        inductance: Terminal [H].
        rotor_inertia: [kg m^2].
        mass: [kg].
        nominal_voltage: [V].
        no_load_current: At nominal voltage [A].
        no_load_speed: At nominal voltage [rad/s].
        coulomb_friction: Speed-independent part of the no-load torque [N m].
        viscous_friction: Part of the no-load torque that grows with speed [N m s/rad].
        nominal_current: Largest continuous current printed [A].
        nominal_torque: Largest continuous torque printed [N m].
        nominal_speed: Speed at which the nominal values hold [rad/s].
        stall_torque, stall_current: At nominal voltage [N m], [A].
        peak_current, peak_torque: Short-time limits printed [A], [N m].
        max_speed: Mechanical limit [rad/s].
        resistance_winding_housing, resistance_housing_ambient: Thermal resistances [K/W].
        resistance_winding_ambient: Where a sheet prints one number for both [K/W].
        winding_time_constant, housing_time_constant: Thermal [s].
        max_winding_temperature: [C].
        reference_temperature: Of resistance and torque constant [C].
        magnet_coefficient: Change of the torque constant with magnet temperature [1/K].
        diameter, length: [m].
        price: In the user's currency; empty in the shipped catalogue.
        source: File and row, sheet, edition: what a report prints.
    """

    key: str
    resistance: float
    torque_constant: float
    maker: str = ""
    series: str = ""
    part_number: str = ""
    kind: str = "brushless"
    frameless: bool = False
    inductance: float | None = None
    rotor_inertia: float | None = None
    mass: float | None = None
    nominal_voltage: float | None = None
    no_load_current: float | None = None
    no_load_speed: float | None = None
    coulomb_friction: float | None = None
    viscous_friction: float | None = None
    nominal_current: float | None = None
    nominal_torque: float | None = None
    nominal_speed: float | None = None
    stall_torque: float | None = None
    stall_current: float | None = None
    peak_current: float | None = None
    peak_torque: float | None = None
    max_speed: float | None = None
    resistance_winding_housing: float | None = None
    resistance_housing_ambient: float | None = None
    resistance_winding_ambient: float | None = None
    winding_time_constant: float | None = None
    housing_time_constant: float | None = None
    max_winding_temperature: float | None = None
    reference_temperature: float = 25.0
    magnet_coefficient: float = -0.001
    diameter: float | None = None
    length: float | None = None
    price: float | None = None
    source: str = ""
