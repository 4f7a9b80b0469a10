"""Inputs are data: no file runs anything, costs too much, or commands a terminal; exit codes mean one thing."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from drivetrain import InputError, load_arm, load_study
from drivetrain.arm.files import expand_xacro
from drivetrain.arm.files.shapes import link_shapes
from drivetrain.catalog.read import read_catalog
from drivetrain.cli import app
from drivetrain.commands.chain import load_chosen
from drivetrain.motion.read import read_motion
from drivetrain.motion.recording import read_recording
from drivetrain.spatial.mesh_inertia import read_mesh

ROOT = Path(__file__).resolve().parents[1]
XACRO = """<robot name="made" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="reach" value="0.25"/><xacro:macro name="rod" params="name"><link name="${name}"/></xacro:macro>
<xacro:rod name="base"/><xacro:rod name="arm"/><xacro:rod name="tool0"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="end" type="fixed"><parent link="arm"/><child link="tool0"/><origin xyz="EXPRESSION 0 0"/></joint>
</robot>"""


def xacro(folder: Path, expression: str) -> Path:
    path = folder / "made.xacro"
    path.write_text(XACRO.replace("EXPRESSION", expression), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("expression", "reach"),
    [
        ("${2*reach}", 0.5),
        ("${radians(180) / math.pi}", 1.0),
        ("${reach if reach &gt; 1 else max(2.0, -reach)}", 2.0),
        ("${[1.0, 3.0][1] + len('ab')}", 5.0),
        ("${'0.25 0.5'.strip().split(' ')[1]}", 0.5),
        ("${xacro.load_yaml('sizes.yaml')['upper']['length']}", 0.7),
        ("${xacro.load_yaml('sizes.yaml').upper.length}", 0.7),
        ("${xacro.load_yaml('$(find made_description)/sizes.yaml').upper.length}", 0.7),
    ],
)
def test_expressions_that_compute_are_expanded(tmp_path: Path, expression: str, reach: float) -> None:
    package = tmp_path / "made_description"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    for place in (package, package / "urdf"):
        (place / "sizes.yaml").write_text("upper: {length: 0.7}")
    assert load_arm(xacro(package / "urdf", expression)).tip[0, 3] == pytest.approx(reach, abs=0.0)


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("${open('/etc/hostname').read()}", "is not evaluated"),
        ("${[x for x in (1, 2)]}", "ListComp is not evaluated"),
        ("${(lambda: 1)()}", "is not evaluated"),
        ("${reach.__class__}", "is not evaluated"),
        ("${math.sin.__self__}", "is not evaluated"),
        ("${str.format('0', reach)}", "is not evaluated"),
        ("${'0'.format(reach)}", "is not evaluated"),
        ("${python.type(reach)}", "is not evaluated"),
        ("${xacro.load_yaml('/etc/hostname')}", "is not below"),
        ("$(eval 1 + 1)", "is not evaluated"),
        ("$(env HOME)", "is not evaluated"),
        ("$(find elsewhere)", "is not below"),
        ("${len('a' * 10**10)}", "cannot expand"),
        ("${9**9**9}", "more than 5 s or 1 GB"),
    ],
)
def test_expressions_that_do_more_are_refused(tmp_path: Path, expression: str, words: str) -> None:
    begin = time.monotonic()
    with pytest.raises(InputError, match=words):
        load_arm(xacro(tmp_path, expression))
    assert time.monotonic() - begin < expand_xacro.SECONDS + 55.0  # ends at all: it ran for hours


def test_a_package_beside_and_an_argument_are_named_with_what_to_do(tmp_path: Path) -> None:
    for name in ("robot_support", "robot_resources"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text("<package/>")
    sought = r"find robot_resources\) is not below .*robot_support; it is in (.*): ROS_PACKAGE_PATH=\1$"
    with pytest.raises(InputError, match=sought) as error:
        load_arm(xacro(tmp_path / "robot_support", "$(find robot_resources)"))
    assert str(error.value).count("$(find") == 1
    with pytest.raises(InputError, match=r"xacro made\.xacro reach:=VALUE > arm\.urdf"):
        load_arm(xacro(tmp_path, "$(arg reach)"))


def test_an_include_outside_its_package_is_refused(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.xacro").write_text("<robot><link name='stolen'/></robot>")
    path = xacro(inside, "1")
    path.write_text(
        path.read_text().replace("<xacro:property", '<xacro:include filename="../secret.xacro"/><xacro:property')
    )
    with pytest.raises(InputError, match="is not below"):
        load_arm(path)


def test_a_trusted_file_may_do_what_xacro_can(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = xacro(tmp_path, "${python.abs(-0.5)}")
    with_comprehension = xacro(tmp_path, "${[x for x in (0.5, 2)][0]}")
    monkeypatch.setenv("DRIVETRAIN_TRUST_XACRO", "1")
    assert load_arm(with_comprehension).tip[0, 3] == 0.5
    assert path == with_comprehension


def test_the_gate_refuses_what_no_expression_should_reach(tmp_path: Path) -> None:
    """Were an expression to get through the first check, the process could still start and write nothing."""
    code = f"""
import os, sys, subprocess
from pathlib import Path
sys.path.insert(0, {str(ROOT)!r})
from drivetrain.arm.files.expand_xacro import shut
shut([Path({str(tmp_path)!r})])
new, old = {str(tmp_path / "new")!r}, {str(tmp_path / "old")!r}
for attempt in (lambda: os.system("true"), lambda: subprocess.run(["true"]), lambda: open(new, "w"),
                lambda: open("/etc/hostname"), lambda: os.remove(old)):
    try:
        attempt()
    except PermissionError:
        print("refused")
"""
    (tmp_path / "old").write_text("kept")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.split() == ["refused"] * 5, done.stderr
    assert (tmp_path / "old").exists() and not (tmp_path / "new").exists()


def laughs() -> str:
    text = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    for depth in range(1, 9):
        text += f"a{depth}: &a{depth} [{', '.join([f'*a{depth - 1}'] * 9)}]\n"
    return text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (laughs(), "stand for more than 100000 entries"),
        ("\n".join(f"k{i}: 1" for i in range(120_000)), "more than 100000 entries"),
        ("a: " + "[" * 5000 + "]" * 5000, "nests too deeply"),
        ("name: " + "x" * 30_000, "has 30000 characters"),
        ("arm: " + "x" * 9_000 + ".urdf", "no such file"),
        ("catalog: " + "x" * 9_000, "catalog"),
        ("x" * 1_000 + ": 1", "1000 characters"),
        ('name: "\\u001b[31mred"', "control characters"),
        ('"\\u009b31mred": 1', "control characters"),
        ('name: "\\ud800"', "control characters"),
        ("supply: {voltage: 1 " + "kV*" * 300 + "V}", "its unit has"),
        ("supply: {voltage: 1 V**" + "9" * 190 + "}", "supply.voltage"),
    ],
)
def test_a_study_that_costs_too_much_is_a_message(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        load_study(path)
    assert len(str(caught.value)) < 5000
    assert "\x1b" not in str(caught.value) and "\x9b" not in str(caught.value)


@pytest.mark.parametrize("name", ["x" * 40_000, "nul\0"], ids=["long", "nul"])
def test_a_name_that_no_file_can_have_is_no_file(tmp_path: Path, name: str) -> None:
    """A message, never longer than who wrote the name can read."""
    for read in (load_arm, lambda name: load_arm(f"package://{name}"), read_mesh, read_catalog, load_study,
                 lambda name: read_recording(f"{name}.csv", joint_names=["a"])):  # fmt: skip
        with pytest.raises(InputError) as caught:
            read(name)
        assert len(str(caught.value)) < 10_000
    shape = f'<visual><geometry><mesh filename="{name}.stl"/></geometry></visual>'.replace("\0", "")
    (tmp_path / "a.urdf").write_text(
        f"""<robot name="a"><link name="b">{shape}</link><link name="l"/>
        <joint name="j" type="continuous"><parent link="b"/><child link="l"/><axis xyz="0 0 1"/></joint></robot>"""
    )
    assert link_shapes(load_arm(tmp_path / "a.urdf")) == []


def test_many_unknown_names_are_told_in_linear_time(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text("\n".join(f"k{i}: 1" for i in range(3000)))
    with pytest.raises(InputError) as caught:
        load_study(path)
    assert len(caught.value.faults) > 3000


def test_control_characters_of_a_catalogue_and_an_arm_never_reach_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "motors.csv").write_text("key,kind,surprise\x1b[2J\nm\x1b]0;x\x07,brushed,1\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_catalog(tmp_path)
    done = CliRunner().invoke(app, ["catalog", "lint", str(tmp_path)])
    for text in (str(caught.value), done.output):
        assert "\x1b" not in text and "\x07" not in text and "\\u001b" in text
    arm = xacro(tmp_path, "1").read_text().replace("turn", "turn\u009b31m").replace("${name}", "x")
    (tmp_path / "made.urdf").write_text(arm.replace("EXPRESSION", "1"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_arm(tmp_path / "made.urdf")
    assert "\x9b" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "read", "words"),
    [
        ("motors.csv", lambda path: read_catalog(path.parent), "at most 256 MB"),
        ("study.yaml", load_study, "at most 4 MB"),
        ("arm.urdf", load_arm, "at most 32 MB"),
        ("link.stl", read_mesh, "at most 256 MB"),
        ("result.json", load_chosen, "at most 256 MB"),
        ("motion.yaml", lambda path: read_motion(path, joint_names=["a"]), r"yaml: the file: has .* at most 256 MB"),
    ],
)  # fmt: skip
def test_a_file_beyond_all_use_is_refused(tmp_path: Path, name: str, read: Any, words: str) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(1 << 30)  # sparse: takes no room
    begin = time.process_time()
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path / name)
    assert len(caught.value.faults) == 1 and time.process_time() - begin < 1.0  # none of it was read


def test_a_workbook_that_unpacks_to_more_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "motors.xlsx", "w", zipfile.ZIP_DEFLATED) as book:
        with book.open("xl/worksheets/sheet1.xml", "w") as sheet:
            for _ in range(260):
                sheet.write(bytes(1 << 20))
    with pytest.raises(InputError, match="at most 256 MB"):
        read_catalog(tmp_path / "motors.xlsx")


def test_a_device_without_an_end_is_refused() -> None:
    """Within 4 GB, of which the program takes a part: read to its end it would take all that the machine has."""
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)); "
        "from drivetrain.cli import main; sys.argv = ['drivetrain', 'check', '/dev/zero']; main()"
    )
    around = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=around)
    assert done.returncode == 2 and "at most 4 MB" in done.stderr, done.stderr


def test_a_result_that_nests_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="the result: cannot be read"):
        load_chosen(tmp_path / "result.json")


def drivetrain(*arguments: str, out: object = subprocess.PIPE, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "drivetrain", *arguments]
    around = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    return subprocess.run(command, stdout=out, stderr=subprocess.PIPE, text=True, env=around)  # type: ignore[call-overload, no-any-return]


def test_a_full_disk_is_no_verdict() -> None:
    with Path("/dev/full").open("w") as full:
        done = drivetrain("--help", out=full)
    assert done.returncode == 3
    assert "No space left" in done.stderr and "Traceback" not in done.stderr


def test_a_reader_that_leaves_is_silent() -> None:
    read, write = os.pipe()
    os.close(read)
    done = drivetrain("catalog", "lint", str(ROOT / "catalogs"), out=write)
    os.close(write)
    assert done.returncode == 141 and not done.stderr


def test_a_fault_of_the_program_is_one_line_and_code_3(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise AssertionError("should not be")

    monkeypatch.setattr("drivetrain.catalog.linting.lint", broken)
    monkeypatch.delenv("DRIVETRAIN_DEBUG", raising=False)
    done = CliRunner().invoke(app, ["catalog", "lint", str(ROOT / "catalogs")])
    assert done.exit_code == 3
    assert "failed: AssertionError: should not be" in done.stderr and "--debug" in done.stderr
    assert "Traceback" not in done.stderr
    monkeypatch.setenv("DRIVETRAIN_DEBUG", "1")
    assert "Traceback" in CliRunner().invoke(app, ["catalog", "lint", str(ROOT / "catalogs")]).stderr
