"""The form of a study file: every fault at once, with its path, its line, what is allowed and the nearest name."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetrain.errors import Fault
from drivetrain.study.document import read_document
from drivetrain.study.faults import read_form
from drivetrain.study.schema import StudyForm, json_schema

GOOD = """
schema_version: 1
motions: {a: {table: x.csv}}
supply: {voltage: 48 V}
joints: {default: {candidates: {}}}
"""


def read(folder: Path, text: str) -> tuple[StudyForm, list[Fault]]:
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    form, faults, _ = read_form(StudyForm, read_document(path))
    return form, faults


def test_a_small_study_is_read_into_si(tmp_path: Path) -> None:
    form, faults = read(
        tmp_path,
        GOOD
        + "ambient: 104 °F\nsafety: {reserve: 15 %, life: 2 h}\n"
        + "payloads:\n  p:\n    mass: 500 g\n    com: '[0, 0, 40] mm'\n"
        + "    inertia: {xx: 3 kg cm^2, yy: 1 g m^2, zz: 2e-4 kg m^2}\n",
    )
    assert faults == []
    assert form.supply.voltage == 48.0
    assert form.ambient == pytest.approx(40.0, abs=1e-12)
    assert form.safety.reserve == pytest.approx(0.15)
    assert form.safety.life == 7200.0
    body = form.payloads["p"]
    assert body.mass == 0.5
    assert body.com == (0.0, 0.0, 0.04)
    assert body.inertia is not None
    assert (body.inertia.xx, body.inertia.yy, body.inertia.zz) == pytest.approx((3e-4, 1e-3, 2e-4), rel=1e-14)


FAULTY = """
schema_version: 2
nmae: x
arm: {dh: x.csv}
drive_mass: addd
motions:
  a: {file: x.csv, smooting: 20 ms}
  b: 3
cycle:
  - {motion: a, repetitions: 1.5}
  - {dwell: 3}
supply: {voltage: 48, peak_power: 3 A}
joints:
  default:
    candidates:
      gears: {kind: strain_wave, ratio: [30], sizes: 1}
      motors: {mass: [1 kg, 500 g]}
    mount: {carrier: parnt}
  e:
    drive: {motor: 123}
    friction: {coulomb: -1 N m}
payloads: {p: {mass: 3, com: [1 mm, 2, 3 mm]}}
motors:
  m: {kind: brushed, winding_basis: line_line, resistance: 1 ohm, torque_constant: 1 mN m/A, source: here}
"""


def test_every_fault_of_a_file_is_listed_at_once(tmp_path: Path) -> None:
    _, faults = read(tmp_path, FAULTY)
    found = {fault.place: fault for fault in faults}
    assert set(found) == {
        "schema_version", "nmae", "arm", "drive_mass", "motions.a.smooting", "motions.b", "cycle[0].repetitions",
        "cycle[1].dwell", "supply.voltage", "supply.peak_power", "joints.default.candidates.gears.ratio",
        "joints.default.candidates.gears.sizes", "joints.default.candidates.motors.mass",
        "joints.default.mount.carrier", "joints.e.drive.gear", "joints.e.friction.coulomb", "payloads.p.mass",
        "payloads.p.com", "motors.m.current_basis",
    }  # fmt: skip
    assert len(faults) == len(found)
    assert "48 V" in found["supply.voltage"].problem
    assert "power" in found["supply.peak_power"].problem
    assert "'name'" in found["nmae"].hint
    assert "'smoothing'" in found["motions.a.smooting"].hint
    assert "'added'" in found["drive_mass"].hint
    assert "'size'" in found["joints.default.candidates.gears.sizes"].hint
    lines = FAULTY.splitlines()
    for fault in faults:
        line = lines[int(fault.file.rsplit(":", 1)[1]) - 1]
        parts = [part.split("[")[0] for part in fault.place.split(".")]
        assert any(part in line for part in parts), f"{fault} does not stand in {line!r}"


def test_the_rest_of_a_faulty_file_is_still_read(tmp_path: Path) -> None:
    form, _ = read(tmp_path, FAULTY)
    assert set(form.joints) == {"default", "e"}
    candidates = form.joints["default"].candidates
    assert candidates is not None
    assert candidates.gears is not None
    assert candidates.gears.kind == ("strain_wave",)
    assert form.joints["e"].drive is None


@pytest.mark.parametrize("name", ["schema_version", "motions", "supply", "joints"])
def test_what_a_study_cannot_do_without_is_asked_for(tmp_path: Path, name: str) -> None:
    text = "\n".join(line for line in GOOD.splitlines() if not line.startswith(name))
    _, faults = read(tmp_path, text)
    assert [(fault.place, fault.problem) for fault in faults] == [(name, "is missing")]


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("ambient: 25 K/W", "temperature"),
        ("ambient: warm", "must be a number with a unit"),
        ("safety: {reserve: 120 %}", "at most 1"),
        ("safety: {reserve: ten}", "must be a number"),
        ("supply: 48 V", "must be a mapping"),
        ("catalogs: [shipped, 1.5]", "must be a name"),
        ("cycle: [{}]", "one of: motion, dwell"),
        ("objective: weight", "'mass', 'price' or 'energy'"),
        ("gravity: [0, 0, -9.81]", "needs a unit"),
        ("joints: {default: {candidates: {pairs: publishd}}}", "'published'"),
        ("joints: {default: {candidates: {pairs: [{motor: a}]}}}", "is missing"),
        ("joints: {default: {candidates: {motors: {frameless: maybe}}}}", "true or false"),
        ("description: 12", "must be a text"),
    ],
)
def test_one_fault_says_what_is_allowed(tmp_path: Path, entry: str, words: str) -> None:
    name = entry.split(":")[0]
    text = "\n".join(line for line in GOOD.splitlines() if not line.startswith(name + ":")) + "\n" + entry
    _, faults = read(tmp_path, text)
    assert len(faults) == 1
    assert words in str(faults[0])
    assert faults[0].place.split(".")[0].split("[")[0] == name


def test_the_json_schema_knows_every_part() -> None:
    schema = json_schema()
    assert schema["$schema"].endswith("2020-12/schema")
    assert set(schema["properties"]) == set(StudyForm.model_fields)
    assert schema["additionalProperties"] is False
    assert set(schema["required"]) == {"schema_version", "motions", "supply", "joints"}
    motor = schema["$defs"]["MotorRow"]
    assert {"torque_constant", "rotor_inertia", "current_basis"} <= set(motor["properties"])
    assert {"current_basis", "winding_basis", "source"} <= set(motor["required"])
