"""Interactive report page: it is evaluated again when task, drives or ratios are changed on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from drivetrain.drive.matching import scaled_gear
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.report.pages.report_page import report_content, report_text
from drivetrain.report.pages.sheet import page_text
from drivetrain.report.quantities import number
from drivetrain.report.words import both, headline, overall_sentence
from drivetrain.sizing.answers.trade_offs import usual_span
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import Pair, given_drives
from drivetrain.sizing.judge.vary import Setup, Vary, named_drives
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Study
from drivetrain.study.parts.candidates import gears_at, motors_at

SEARCH_TIME = 1.5  # s a selection may take; what is left unproven is said on the page
LARGEST = 1e6  # of any number that is asked for, in the unit of its control
LEAST = {Vary.PAYLOAD: 0.0, Vary.CYCLE_TIME: 1e-3, Vary.VOLTAGE: 1e-3, Vary.AMBIENT: -273.15, Vary.FORCE: 0.0}
KINDS = {"values": "must give numbers by the name of their control", "drives": "must give motor and gear by joint",
         "ratios": "must give numbers by joint"}  # fmt: skip


@dataclass(frozen=True)
class Control:
    """A quantity of the task that can be changed on the page, with the range of its slider."""

    name: str
    unit: str
    now: float
    low: float
    high: float
    vary: Vary
    payload: str = ""


class LivePage:
    """A study on an interactive page, which initially shows the first result."""

    def __init__(self, study: Study, first: Evaluation | Selection) -> None:
        self.study, self.first = study, first
        self.controls = {one.name: one for one in _controls(study)}
        self._kept: tuple[Any, WorkFamily] | None = None

    def page(self) -> str:
        evaluation, _ = both(self.first)
        tasks = {task.name: task for task in self.study.joints}
        catalog, lists, joints = self.study.catalog, dict[Any, int](), []
        for name, (motor, gear, ratio) in _drives(evaluation).items():
            pairs = tasks[name].pairs
            offered = (
                [pair[k] for pair in pairs] if pairs else rows
                for k, rows in enumerate((motors_at(tasks[name], catalog), gears_at(tasks[name], catalog)))
            )
            keys = tuple(tuple(dict.fromkeys(key for key in some if key and key[0] != "+")) for some in offered)
            joints.append({"name": name, "motor": motor, "gear": gear, "ratio": ratio,
                           "list": lists.setdefault(keys, len(lists))})  # fmt: skip
        live = page_text("live.html.j2", controls=self.controls.values(), joints=joints, lists=list(lists))
        return report_text(*report_content(self.first), live=live)

    def answer(self, request: Any, *, anew: bool = False) -> dict[str, Any]:
        """Report of a request, for the page's scripts (see ``KINDS``); ``anew``: with drives selected again."""
        result = self.result(request, anew=anew)
        content, data, pictures = report_content(result, briefly=True)
        evaluation, selection = both(result)
        return {
            "content": page_text("report.html.j2", **content),
            "data": {"charts": pictures.charts, **data},
            "told": f"{result.verdict}: {headline(evaluation, selection)}\n{overall_sentence(evaluation)}",
            "drives": _drives(evaluation),
        }

    def result(self, request: Any, *, anew: bool = False) -> Evaluation | Selection:
        """The engine's own result: of ``evaluate``, or of ``select``, for the changed study."""
        values, drives, ratios, faults = _read(request)
        for name, value in values.items():
            if name not in self.controls:
                hint = nearest(name, self.controls)
                faults.append(Fault(name, "is not a quantity that can be changed", value, hint))
            elif not (least := LEAST[self.controls[name].vary]) <= value <= LARGEST:
                unit = self.controls[name].unit
                faults.append(Fault(name, f"must be from {least:g} to {LARGEST:g} {unit}", value))
        names = [task.name for task in self.study.joints if task.axis_name == task.name]
        for name, value in ratios.items():
            if name not in names:
                faults.append(Fault(name, "is no joint of the study", value, nearest(name, names)))
            elif not 1.0 / LARGEST <= value <= LARGEST:
                faults.append(Fault(f"ratio of {name}", f"must be from {1.0 / LARGEST:g} to {LARGEST:g}", value))
        raise_faults(faults)
        changes = [(self.controls[name], value) for name, value in values.items()]
        changes = [(one, value) for one, value in changes if value != one.now]
        if not anew:
            return self._setup(changes, drives, ratios).evaluation()
        study = self.study
        for one, value in changes:
            study = changed(study, one.vary.change(study, value, one.payload))
        wanted = replace(study.wanted, time_limit=min(study.wanted.time_limit, SEARCH_TIME))
        return select(replace(study, wanted=wanted))

    def _setup(
        self, changes: list[tuple[Control, float]], drives: Mapping[str, Pair], ratios: Mapping[str, float]
    ) -> Setup:
        """Drives of the catalogue, some with other ratios, all else of their sheets kept, at the changed task."""
        study, keys = self.study, given_drives(self.study, drives)
        task = TaskChange()
        payloads = [(one.payload, value / one.now) for one, value in changes if one.vary is Vary.PAYLOAD]
        for one, value in changes:
            change = one.vary.change(study, value, one.payload)
            task = replace(task, time=task.time * change.time, voltage=task.voltage * change.voltage,
                           ambient=task.ambient + change.ambient, force=task.force * change.force)  # fmt: skip
        if payloads:
            task = replace(task, payload=payloads[0][1], payloads=(payloads[0][0],))
        family = self._family(tuple(payloads[1:]), task.payloads)
        mounted = named_drives(study, keys)
        for i, drive in mounted.items():
            name, own = study.joints[i].axis_name, abs(drive.gear.ratio)
            wanted = ratios.get(name, own)
            if wanted != own and drive.gear.direct:
                raise InputError(Fault(f"ratio of {name}", "a direct drive has no gear", wanted, "choose a gear"))
            if wanted != own:
                words = f"ratio {wanted:g} in place of {own:g}: no gear of the catalogue"
                gear, assumptions = scaled_gear(drive.gear, wanted), (*drive.assumptions, words)
                mounted[i] = replace(drive, gear=gear, assumptions=assumptions)
        return Setup(family.at(task), mounted)

    def _family(self, others: tuple[tuple[str, float], ...], payloads: tuple[str, ...]) -> WorkFamily:
        """The work of the task with other payloads already changed; the last is kept, as a slider asks again."""
        if self._kept is None or self._kept[0] != (others, payloads):
            study = self.study
            for name, share in others:
                study = changed(study, TaskChange(payload=share, payloads=(name,)))
            self._kept = (others, payloads), WorkFamily(study, payloads)
        return self._kept[1]


def _controls(study: Study) -> list[Control]:
    payloads = [one for one in study.payloads if one.mass > 0.0] if study.arm is not None else []
    varied = [(Vary.PAYLOAD, one.name) for one in payloads]
    varied += [(Vary.FORCE, "")] if study.cycle.tip_wrench is not None else []
    varied += [(Vary.CYCLE_TIME, ""), (Vary.VOLTAGE, ""), (Vary.AMBIENT, "")]
    found = []
    for vary, payload in varied:
        now, (low, high) = vary.now(study, payload), usual_span(study, vary)
        if vary in (Vary.PAYLOAD, Vary.FORCE):
            low, high = 0.0, 2.0 * now
        label = f"payload {payload}" if payload else str(vary).replace("_", " ")
        unit = "°C" if vary is Vary.AMBIENT else vary.unit
        found.append(Control(label, unit, now, float(number(low)), float(number(high)), vary, payload))
    return found


def _read(request: Any) -> tuple[dict[str, float], dict[str, Pair], dict[str, float], list[Fault]]:
    """The parts of a request by their kind, and their faults."""
    faults = []
    if not isinstance(request, Mapping) or not set(request) <= set(KINDS):
        raise InputError(Fault("the question", f"must be a mapping of {', '.join(KINDS)}", request))
    parts: dict[str, dict[str, Any]] = {name: request.get(name, {}) for name in KINDS}
    for name, problem in KINDS.items():
        if not isinstance(parts[name], dict):
            faults.append(Fault(name, problem, parts[name]))
            parts[name] = {}
    for name in ("values", "ratios"):
        for key, value in parts[name].items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                faults.append(Fault(key, "must be a number", value))
        parts[name] = {key: float(one) for key, one in parts[name].items() if isinstance(one, int | float)}
    for joint, pair in parts["drives"].items():
        if not (isinstance(pair, list) and len(pair) == 2 and all(isinstance(one, str) for one in pair)):
            faults.append(Fault(f"drives.{joint}", "must be the keys of a motor and a gear", pair))
    pairs = {joint: (pair[0], pair[1]) for joint, pair in parts["drives"].items()} if not faults else {}
    return parts["values"], pairs, parts["ratios"], faults


def _drives(evaluation: Evaluation) -> dict[str, tuple[str, str, float]]:
    """Motor, gear and its ratio by joint, of two motors on one axis once; a drive without a gear, also one with stages,
    has ratio 0 here.
    """
    return {
        task.name: (joint.motor, "", 0.0)
        if joint.drive.gear.direct
        else (joint.motor, joint.gear, abs(joint.drive.gear.ratio))
        for task in evaluation.study.joints
        if task.axis_name == task.name and (joint := evaluation.joints.get(task.name)) is not None
    }
