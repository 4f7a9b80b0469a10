"""The page is one well-formed file that needs nothing from outside, holds every check, and never changes by itself."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from drivetrain.report.charts.motion_data import FOLLOWS
from drivetrain.report.outputs import result_json
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.pages.views import anchor, check_rows, nearest_misses
from drivetrain.report.quantities import percent
from drivetrain.report.words import OUTSIDE, check_sentence, headline, heat_model, overall_sentence, required_text
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.study.model import Safety
from drivetrain.study.parts.verdicts import Check, Verdict

VOID = {"meta", "link", "br", "hr", "img", "input", "col", "wbr"}


class Structure(HTMLParser):
    """Checks nesting, and collects ids, links and what would be loaded."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.loads: list[str] = []
        self.rows: list[list[str]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        if tag not in VOID:
            self.open.append(tag)
        if "id" in values:
            self.ids.append(values["id"])
        if tag == "a":
            self.links.append(values.get("href", ""))
        self.loads += [v for n, v in values.items() if n in ("src", "xlink:href", "data", "action", "srcset")]
        if tag in ("link", "iframe", "object", "embed", "base"):
            self.loads.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("style", "script"):
            return
        self.text += data
        if self.rows and self.rows[-1] and "tr" in self.open:
            self.rows[-1][-1] += data.strip()


def read(page: str) -> Structure:
    structure = Structure()
    structure.feed(page)
    structure.close()
    assert structure.open == []
    return structure


@pytest.fixture(scope="module")
def sized(evaluation: Evaluation) -> str:
    return html_report(evaluation)


@pytest.fixture(scope="module")
def selected(selection: Selection) -> str:
    return html_report(selection)


def test_well_formed_and_self_contained(sized: str, selected: str) -> None:
    for page in (sized, selected):
        found = read(page)
        assert all(load.startswith(("data:image/png;base64,", "#")) for load in found.loads)
        assert not re.search(r"@import|url\((?!#)", page)
        assert not re.search(r"""\b(?:fetch|XMLHttpRequest|import)\s*\(""", page)


def test_ids_are_unique_and_links_lead_somewhere(selected: str) -> None:
    found = read(selected)
    assert len(found.ids) == len(set(found.ids))
    assert found.links and {link[1:] for link in found.links} <= set(found.ids)


def test_no_path_no_clock(sized: str) -> None:
    assert "/somewhere/on/one/machine" not in sized
    assert not re.search(r"\b20\d\d-\d\d-\d\d", sized)


def test_text_of_the_study_is_escaped(sized: str) -> None:
    assert "<and nothing else>" not in sized and "&lt;and nothing else&gt;" in sized
    assert "Acme &lt;&amp;&gt; Sons" in sized


def test_every_check_of_every_joint_is_in_the_table(sized: str, evaluation: Evaluation) -> None:
    rows = [row for row in read(sized).rows if len(row) == 11][1:]
    told = {(row[0], row[1]): row for row in rows}
    wanted = [(j.name, c) for j in evaluation.joints.values() for c in j.checks] + [
        ("supply", c) for c in evaluation.shared
    ]
    assert len(told) == len(rows) == len(wanted)
    for joint, check in wanted:
        row = told[joint, check.name]
        assert row[2] == check.verdict
        assert row[9] == check.source and row[10] == check.remark
        assert row[3] == ("–" if check.utilisation is None else row[3]) != ""


def test_numbers_are_shown_in_the_units_engineers_use(sized: str) -> None:
    rows = {(row[0], row[1]): row for row in read(sized).rows if len(row) == 11}
    speed = rows["shoulder_pan", "motor speed"]
    assert speed[6] == "rpm" and speed[5] == "5\u202f730"  # 600 rad/s
    heat = rows["elbow", "winding temperature"]
    assert heat[3:9] == ["108\u00a0%", "167", "155", "°C", "−12.4", "3.10 s"]


def test_pictures_stand_after_the_verdict_and_before_the_assumptions(sized: str) -> None:
    order = ("verdict", "cycle", "planes", "limits-used", "utilisation", "assumptions", "unchecked")
    places = [sized.index(f'<section id="{name}"') for name in order]
    assert places == sorted(places)
    block = sized[sized.index('id="assumptions"') : sized.index('id="rows"')]
    for told in ("25 °C", "48.0", "× 1.2", "frameless", "standstill", "Izz"):
        assert told in block
    assert "range of the sheets" not in block  # no gear of the set needs that assumption: their rows have an efficiency
    assert "at least 20\u202f000 h" in block


def test_verdict_names_the_binding_limit_and_its_instant(sized: str) -> None:
    text = read(sized).text.replace("\u00a0", " ")
    assert "The drives do not meet all limits." in text
    assert "Furthest over its limit: elbow: winding temperature 167 °C at t = 3.10 s, limit 155 °C (108 %)." in text


def test_every_joint_has_a_plane_a_slider_and_its_numbers_without_script(sized: str, evaluation: Evaluation) -> None:
    block = sized[sized.index('<section id="planes"') : sized.index('<section id="limits-used"')]
    for number, joint in enumerate(evaluation.joints.values()):
        assert f'id="plane-{number}"' in block and f'id="ratio-{number}"' in block
        start = block.index(f'id="readings-{number}"')
        rows = read(
            "<table>" + block[start - len("<tbody ") : block.index("</tbody>", start)] + "</tbody></table>"
        ).rows
        told = {row[0]: row[1] for row in rows}
        wanted = {c.name: percent(c.utilisation) for c in joint.checks if c.name in FOLLOWS}
        assert told == wanted and len(told) == 5


def test_catalogue_rows_are_verbatim_with_source(sized: str) -> None:
    block = sized[sized.index('<section id="rows"') :]
    assert "made-up sheet, edition 2024, row 3" in block and "made-up sheet, page 12" in block
    rows = [row for row in read(sized).rows if len(row) == 3]
    assert ["resistance", "0.133333", "ohm"] in rows
    assert ["max winding temperature", "155", "°C"] in rows
    assert "Not in the catalogue row:" in block


def test_what_was_not_checked_is_listed_with_the_reason(sized: str) -> None:
    block = sized[sized.index('<section id="unchecked"') :]
    assert block.count("no rated life in the catalogue row") == 3
    shown = read(sized).text
    assert all(text.replace("`", "") in shown for row in OUTSIDE for text in row)


def test_currents_are_told_in_the_ampere_of_the_study_too(evaluation: Evaluation) -> None:
    study = evaluation.study
    rms = tuple(replace(one, amplifier=replace(one.amplifier, current_basis="rms")) for one in study.joints)
    found = evaluate(replace(study, joints=rms))
    check = next(one for one in found.joints["elbow"].checks if one.name == "motor RMS current")
    assert check.required is not None and check.available is not None
    told = f"{check.required / math.sqrt(1.5):.3g} of {check.available / math.sqrt(1.5):.3g} A rms"
    assert told in check_sentence(check) and told in html_report(found)
    data = json.loads(result_json(found))["joints"]["elbow"]["checks"]
    inside = next(one["in_study_amperes"] for one in data if one["name"] == check.name)
    assert inside["basis"] == "rms" and inside["required"] == pytest.approx(check.required / math.sqrt(1.5))
    assert "A rms" not in html_report(evaluation)


def test_the_current_of_a_brushed_motor_is_told_as_direct_current(evaluation: Evaluation) -> None:
    study = evaluation.study
    rms = tuple(replace(one, amplifier=replace(one.amplifier, current_basis="rms")) for one in study.joints)
    motors = {key: replace(motor, kind="brushed") for key, motor in study.catalog.motors.items()}
    found = evaluate(replace(study, joints=rms, catalog=replace(study.catalog, motors=motors)), evaluation.drives)
    check = next(one for one in found.joints["elbow"].checks if one.name == "amplifier continuous current")
    assert check.current_basis == "dc" and check.available is not None
    stated = f"{check.available / math.sqrt(1.5):.4g} A rms of sinusoidal phases"
    at_loss = f"at equal loss {check.available:.4g} A DC"
    assert check.source == f"amplifier continuous current of the study: {stated}, {at_loss}"
    assert "A rms" not in html_report(found).replace("A rms of sinusoidal phases", "")


@pytest.mark.parametrize(
    ("sheet", "mounting", "told"),
    [
        (
            (1.0, 4.0, None),
            None,
            "two nodes, winding to housing 1.00 K/W (data sheet), housing to ambient 4.00 K/W (data sheet)",
        ),
        ((1.0, 4.0, None), 2.0, "housing to ambient 2.00 K/W (the study's mounting)"),
        ((None, None, 5.0), None, "one node, 5.00 K/W from winding to ambient"),
        ((None, None, None), 2.0, "temperatures not computed"),
    ],
)
def test_the_heat_model_is_named(evaluation: Evaluation, sheet, mounting, told: str) -> None:
    names = ("resistance_winding_housing", "resistance_housing_ambient", "resistance_winding_ambient")
    motor = replace(evaluation.joints["elbow"].drive.motor, **dict(zip(names, sheet, strict=True)))
    assert told in heat_model(motor, mounting)


def test_selection_says_why_the_others_fell(selected: str, selection: Selection) -> None:
    found = read(selected)
    assert "Rejected candidates" in found.text
    counts = [
        row
        for row in found.rows
        if row and row[0] in selection.evaluation.joints and len(row) == 5 and row[1].isdigit()
    ]
    assert [row[1] for row in counts] == ["400"] * 3
    assert all(sum(map(int, row[2:])) == 400 for row in counts)
    assert "acme-9" in found.text and "proof: optimal" in found.text
    nearest = nearest_misses(selection.rejected, "elbow", selection.evaluation.study.safety)
    shares = sorted(one.utilisation for one in selection.rejected_pairs if one.joint == "elbow")
    assert nearest[0][6].startswith(f"{100 * shares[0]:.1f}"[:5])
    assert all(
        ("× 1.2 =" in required) == (check == "gear repeated peak torque") for _, _, check, required, *_ in nearest
    )
    assert {check for _, _, check, *_ in nearest} > {"gear repeated peak torque"}


def test_when_nothing_fits_the_advice_is_at_the_top(nothing_fits: Selection) -> None:
    text = read(html_report(nothing_fits)).text
    assert "FAIL" in text and "No allowed set of drives meets all limits." in text
    assert text.index("a 10 % lower speed would do") < text.index("Inputs and assumptions")


def test_bare_sheets_still_give_a_page(without_data: Evaluation) -> None:
    text = read(html_report(without_data)).text
    assert "NOT CHECKED" in text and "Nothing could be checked" in text
    assert "Traceback" not in text


def test_same_bytes_in_another_process(selected: str) -> None:
    """Another hash seed and another clock; the page may depend on neither."""
    factory = Path(__file__).with_name("conftest.py")
    code = (
        "import importlib.util, sys, hashlib\n"
        f"spec = importlib.util.spec_from_file_location('factory', {str(factory)!r})\n"
        "factory = importlib.util.module_from_spec(spec); spec.loader.exec_module(factory)\n"
        "from drivetrain.report.pages.report_page import html_report\n"
        "page = html_report(factory.made_up_selection())\n"
        "print(hashlib.sha256(page.encode()).hexdigest())\n"
    )
    environment = os.environ | {"PYTHONHASHSEED": "77", "SOURCE_DATE_EPOCH": "86400", "TZ": "Asia/Tokyo"}
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == hashlib.sha256(selected.encode()).hexdigest()


def test_weight(selected: str) -> None:
    """Below 2.5 MB for any example: half a megabyte for the library, a tenth a joint, and the candidates."""
    assert len(selected.encode()) < 1_000_000
    assert selected.count('id="library"') == 1


def test_words_for_every_verdict(evaluation: Evaluation, without_data: Evaluation, nothing_fits: Selection) -> None:
    assert headline(evaluation, None) == "The drives do not meet all limits."
    assert headline(without_data, None).startswith("Nothing could be checked")
    assert headline(nothing_fits.evaluation, nothing_fits).startswith("No allowed set")
    assert overall_sentence(without_data) == "Nothing could be checked: the data sheets lack values."
    endless = Check(
        "winding temperature", float("inf"), 155.0, "C", float("inf"), Verdict.FAIL, None, "", "no steady one"
    )
    assert check_sentence(endless) == "winding temperature: no steady one"


def test_actual_value_factor_and_factored_value_are_told(sized: str, evaluation: Evaluation) -> None:
    found = Check("gear repeated peak torque", 57.36, 70.0, "N m", 57.36 / 70.0, Verdict.PASS, 0.7, "", factor=1.2)
    sentence = "gear repeated peak torque 47.8 N m × 1.2 = 57.4 N m at t = 0.700 s, limit 70.0 N m (82 %)"
    assert check_sentence(found).replace("\u00a0", " ") == sentence
    assert sentence.replace("47.8 N m × 1.2 = ", "") == check_sentence(replace(found, factor=1.0)).replace(
        "\u00a0", " "
    )
    product = replace(found, required=299.4, available=3119.0, utilisation=299.4 / 3119.0)
    assert required_text(product, "N m") == "249.5 × 1.2 = 299"  # 250 × 1.2 would be 300
    rows = {(row[0], row[1]): row[4] for row in read(sized).rows if len(row) == 11}
    for name, joint in evaluation.joints.items():
        for check in joint.checks:
            told = rows[name, check.name]
            assert ("× 1.2 =" in told) == (check.factor == 1.2)
            if check.factor == 1.2:
                actual, required = (float(told.split(sign)[i]) for sign, i in (("×", 0), ("=", 1)))
                assert 1.2 * actual == pytest.approx(required, rel=6e-3)
    assert "drawn without safety factors" in sized
    plain = replace(evaluation, study=replace(evaluation.study, safety=Safety()))
    assert "drawn without safety factors" not in html_report(plain)


def test_keys_stand_with_maker_series_and_part_number(selected: str) -> None:
    start = selected.index(f'<section id="{anchor("elbow")}"')
    block = selected[start : selected.index("</section>", start)]
    assert "Acme &lt;&amp;&gt; Sons M M-2" in block and "Wave W W-2-100" in block


def test_rows_give_what_was_required_even_when_nothing_limits(evaluation: Evaluation) -> None:
    told = [row for row in check_rows(evaluation) if row.name == "inertia ratio"]
    assert [row.required for row in told] == ["1.80"] * 3 and {row.available for row in told} == {"–"}
