"""Whatever stands in a study file, it loads or is refused with faults; and editors see what the loader sees."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from drivetrain.errors import InputError
from drivetrain.study.read import load_study
from drivetrain.study.schema import json_schema
from drivetrain.whole_files import shipped

JUNK = [None, 0, -1, 3.7, True, "x", "48 V", "1 kg", "-5 deg", "", [], {}, [1], ["a", "b"], {"a": 1}, "none",
        float("nan"), "1e300 s", "[0, 0, 1] mm", 10**30, "default", "1e-30 rad/s"]  # fmt: skip


def places(data: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if place:
        yield place
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in entries:
        yield from places(value, (*place, key))


def spoiled(data: Any, random: np.random.Generator) -> Any:
    """The data with one entry replaced by junk, taken out, or given another name."""
    data = copy.deepcopy(data)
    all_places = list(places(data))
    *outer, last = all_places[random.integers(len(all_places))]
    part = data
    for key in outer:
        part = part[key]
    way = random.integers(5)
    if way < 3:
        part[last] = JUNK[random.integers(len(JUNK))]
    elif way == 3 or isinstance(part, list):
        del part[last]
    else:
        part[f"{last}x"] = part.pop(last)
    return data


@pytest.mark.parametrize("seed", range(3))
def test_junk_is_refused_with_faults_and_nothing_else(load: Any, folder: Path, seed: int) -> None:
    load()
    path = folder / "study.yaml"
    whole = yaml.safe_load(path.read_text(encoding="utf-8"))
    random = np.random.default_rng(seed)
    refused = 0
    for _ in range(60):
        path.write_text(yaml.safe_dump(spoiled(whole, random)), encoding="utf-8")
        try:
            load_study(path)
        except InputError as error:
            assert error.faults
            assert all(fault.file for fault in error.faults)
            refused += 1
    assert refused > 30  # else the junk is not junk


def misfits(value: Any, schema: dict[str, Any], top: dict[str, Any], place: str = "") -> list[str]:
    """What a value breaks of the parts of JSON Schema that the study's schema uses."""
    if "$ref" in schema:
        return misfits(value, top["$defs"][schema["$ref"].rsplit("/", 1)[1]], top, place)
    choices = schema.get("anyOf") or schema.get("oneOf")
    if choices:
        told = [misfits(value, choice, top, place) for choice in choices]
        return [] if [] in told else [f"{place}: none of its forms"]
    kinds = {"string": str, "number": (int, float), "integer": int, "boolean": bool, "null": type(None), "array": list,
             "object": dict}  # fmt: skip
    wanted = schema.get("type", list(kinds))
    wanted = wanted if isinstance(wanted, list) else [wanted]
    if not any(isinstance(value, kinds[kind]) for kind in wanted):
        return [f"{place}: {value!r} is no {wanted}"]
    found = [f"{place}: not the one value"] if value != schema.get("const", value) else []
    found += [f"{place}: not one of the words"] if value not in schema.get("enum", [value]) else []
    if isinstance(value, list):
        return found + [
            m for i, item in enumerate(value) for m in misfits(item, schema.get("items", {}), top, f"{place}[{i}]")
        ]
    if isinstance(value, dict):
        names, others = schema.get("properties", {}), schema.get("additionalProperties", {})
        found += [f"{place}: lacks {name}" for name in schema.get("required", []) if name not in value]
        for name, item in value.items():
            inner = names.get(name, others)
            found += [f"{place}: unknown {name}"] if inner is False else misfits(item, inner, top, f"{place}.{name}")
    return found


@pytest.mark.parametrize("path", sorted(shipped("examples").glob("*/study.yaml")), ids=lambda path: path.parent.name)
def test_editors_find_nothing_wrong_with_the_examples(path: Path) -> None:
    schema = json_schema()
    study = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert misfits(study, schema, schema) == []
    study["suply"] = study.pop("supply")
    assert misfits(study, schema, schema) == [": lacks supply", ": unknown suply"]
