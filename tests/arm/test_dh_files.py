"""Denavit-Hartenberg tables as JSON, Excel and models of the Robotics Toolbox: the arm of the same table as CSV."""

from __future__ import annotations

import json

import numpy as np
import openpyxl
import pytest

import drivetrain as dt
from drivetrain.arm.files.dh_table import read_dh_table
from drivetrain.errors import InputError

# Two joints that turn and one that slides, made up.
CSV = """kind,theta [rad],d [m],a [m],alpha [rad],offset,mass [kg],com_x [m],com_y [m],com_z [m],\
ixx [kg m^2],iyy [kg m^2],izz [kg m^2],ixy [kg m^2],iyz [kg m^2],ixz [kg m^2],lower,upper
revolute,0,0.3,0.2,{half},0.1 rad,5,-0.1,0.01,0.02,0.05,0.06,0.07,0.001,0.002,0.003,{low} rad,{high} rad
prismatic,0.4,0,0.1,-{half},0.05 m,3,0,0.2,0,0.03,0.03,0.01,0,0,0,0.1 m,0.6 m
revolute,0,0.1,0,0,0 rad,1,0,0,0.1,0.004,0.005,0.006,0,0,0,,
""".format(half=np.pi / 2, low=-np.deg2rad(160.0), high=np.deg2rad(160.0))

MATLAB = """% a model with a 'quote' in a comment
clear L
deg = pi/180; a1 = 0.2;
L(1) = {revolute}('d', 0.3, ... % continued
    'a', a1, 'alpha', pi/2, 'offset', 0.1, ...
    'I', [0.05, 0.06 0.07, 0.001, 0.002, 0.003], 'r', [-0.1 0.01 0.02], 'm', 5, ...
    'Jm', 200e-6, 'G', -62.6, 'Tc', [0.4 -0.4], 'qlim', [-160 160]*deg );
%            theta  d   a    alpha  sigma offset
L(2) = Link([ 0.4   0   0.1  -pi/2  1     0.05 ]{flag});
L(2).m = 3;  L(2).r = [0 0.2 0];
L(2).I = [0.03 0 0; 0 0.03 0; 0 0 0.01];
L(2).qlim = [10 60] * 0.01;
L(3) = {revolute}('d', 0.5^2 - 0.15, 'a', 0, 'alpha', 0, 'm', 1, 'r', [0 0 0.1], 'I', [4e-3 5e-3 6e-3]);
bot = SerialLink(L, 'name', 'made up');
"""

PYTHON = '''
"""RevoluteDH(d=9) in a text is none."""
from math import pi
import numpy as np
from roboticstoolbox import DHRobot, PrismaticDH, RevoluteDH

class MadeUp(DHRobot):
    def __init__(self, symbolic=False):
        if symbolic:
            half = sym.pi() / 2
        else:
            half = np.pi / 2
        deg = pi / 180
        L = [
            {revolute}(d=0.3, a=0.2, alpha=half, offset=0.1, I=[0.05, 0.06, 0.07, 0.001, 0.002, 0.003], m=5,
                r=[-0.1, 0.01, 0.02], Jm=2e-4, G=-62.6, qlim=[-160 * deg, 160 * deg]),
            {prismatic}(theta=0.4, a=0.1, alpha=-half, offset=0.05, m=3, r=np.array([0, 0.2, 0]), qlim=[0.1, 0.6],
                I=np.diag([0.03, 0.03, 0.01])),
            {revolute}(d=0.1, m=1, r=[0, 0, 0.1], I=[4e-3, 5e-3, 6e-3]),
        ]
        super().__init__(L, name="made up")
'''


def same(found, wanted):
    for name in ("home", "screws", "masses", "inertias", "tip", "lower", "upper"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), rtol=1e-12, atol=1e-14, err_msg=name)


def model(suffix, convention):
    modified = convention == "modified"
    if suffix == ".py":
        kind = "MDH" if modified else "DH"
        return PYTHON.replace("{revolute}", f"Revolute{kind}").replace("{prismatic}", f"Prismatic{kind}")
    flag = ", 'modified'" if modified else ""
    return MATLAB.replace("{revolute}", "RevoluteMDH" if modified else "Revolute").replace("{flag}", flag)


@pytest.mark.parametrize("convention", ["classic", "modified"])
@pytest.mark.parametrize("suffix", [".m", ".py", ".json", ".xlsx"])
def test_is_the_arm_of_the_table(tmp_path, suffix, convention):
    (tmp_path / "table.csv").write_text(CSV, encoding="utf-8")
    wanted, path = read_dh_table(tmp_path / "table.csv", convention), tmp_path / f"arm{suffix}"
    header, *rows = (line.split(",") for line in CSV.strip().splitlines())
    if suffix == ".json":
        path.write_text(json.dumps({"links": [dict(zip(header, row, strict=True)) for row in rows]}), encoding="utf-8")
    elif suffix == ".xlsx":
        book = openpyxl.Workbook()
        for line in [header, *[[float(c) if c.replace(".", "").isdigit() else c or None for c in row] for row in rows]]:
            book.active.append(line)
        book.save(path)
    else:
        path.write_text(model(suffix, convention), encoding="utf-8")
    found = read_dh_table(path, convention)
    same(found, wanted)
    assert any("not used" in note for note in found.notes) == (suffix in (".m", ".py"))


def test_a_convention_must_be_that_of_the_model(tmp_path):
    path = tmp_path / "arm.m"
    path.write_text(model(".m", "classic"), encoding="utf-8")
    with pytest.raises(InputError, match="the model is classic"):
        read_dh_table(path, "modified")


ONE_BY_ONE = """deg = pi/180;
L(1) = Link([0 0.3 0.2 pi/2]);
L(2) = Link([0.4 0 0.1 -pi/2 1]);
L(3) = Link('d', 0.1, 'a', 0, 'alpha', 0, 'offset', 10*deg);
"""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        # Of a joint that turns the toolbox reads no theta, of one that slides no d.
        ("a.m", ONE_BY_ONE.replace("[0 0.3", "[1 0.3").replace("[0.4 0 ", "[0.4 7 ")),
        (
            "a.m",
            "d = pi/18; r = SerialLink([\n Revolute('d', 0.3, 'a', 0.2, 'alpha', pi/2)\n"
            " Prismatic('theta', 0.4, 'a', 0.1, 'alpha', -pi/2)\n Revolute('d', 0.1, 'offset', d)\n],'name','a;b');",
        ),
        (
            "a.m",
            "links = [ Revolute('d', 0.3, 'a', 0.2, 'alpha', pi/2); Link([0.4 0 0.1 -pi/2 1]);\n"
            "Revolute('d', 0.1, 'offset', pi/18)];",
        ),
        (
            "a.py",
            "L = [RevoluteDH(0.3, 0.2, pi/2), PrismaticDH(0.4, 0.1, alpha=-pi/2),"
            " RevoluteDH(0.1, 0, 0, pi/18, flip=False)]",
        ),
    ],
)
def test_links_as_models_write_them(tmp_path, name, text):
    (tmp_path / "one.m").write_text(ONE_BY_ONE, encoding="utf-8")
    (tmp_path / name).write_text(text, encoding="utf-8")
    same(read_dh_table(tmp_path / name, "classic"), read_dh_table(tmp_path / "one.m", "classic"))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.m", "L(1) = Link('d', q1, 'a', 0, 'm', 1);", "line 1: is no link with plain numbers: q1"),
        ("a.m", "x = 3;", "holds no joint"),
        ("a.m", "L(1) = Revolute('d', 1, 'flip', 'a', 2);", "flipped"),
        ("a.py", "L = [RevoluteDH(d=1, flip=True)]", "flipped"),
        ("a.py", "L = [DHLink(0.3, 0.2)]", "needs names"),
        ("a.m", "L(1) = Link([0 1 0 0]');", "not of plain numbers"),
        ("a.m", "a = SerialLink([Revolute() Revolute()]);\nb = SerialLink([Revolute() Revolute()]);", "another chain"),
        ("a.m", "L(1) = Revolute('d', 1, 'r', [1 2]);", "rx, ry, rz"),
        ("a.py", "L = [RevoluteDH(d=open('x'))]", r"open\('x'\) is not known"),
        ("a.py", "L = [RevoluteDH(", "cannot be read"),
        ("a.py", "L = [rtb.RevoluteDH(a=1) for i in range(3)]", "line 1 makes links in a loop"),
        ("a.py", "for i in range(3):\n    L.append(RevoluteDH(a=1))", "line 1 makes links in a loop"),
        ("a.m", "L(1) = Link([0 1 0 0]);\nfor i=2:3\n  L(i) = Link([0 0 1 0]);\nend", "line 3 makes links in a loop"),
        ("a.m", "L(1) = Link([0 1 0 0]);\nfor i=1:1\n  L(i).m = 2;\nend", "line 3 makes links in a loop"),
        ("a.json", "[1, 2]", "must hold a list of links"),
        ("a.json", '[{"a [m]": 1}]', "column alpha: is missing"),
        ("a.xlsx", "no workbook", "cannot be read"),
    ],
)
def test_what_is_no_table(tmp_path, name, text, words):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_dh_table(path, "classic")


def test_a_study_names_such_a_file(tmp_path):
    (tmp_path / "arm.m").write_text(model(".m", "classic"), encoding="utf-8")
    data = {
        "arm": {"dh": str(tmp_path / "arm.m"), "convention": "classic"}, "drive_mass": "included",
        "motions": {"m": {"waypoints": [[0, 0.2, 0], [1, 0.3, 1]], "profile": "quintic", "durations": [1.0]}},
        "open_cycle": True, "supply": {"voltage": 48},
        "joints": {"default": {"candidates": {}, "travel_per_turn": 0.01}},
    }  # fmt: skip
    assert dt.load_study(data).arm.masses.tolist() == [5.0, 3.0, 1.0]
