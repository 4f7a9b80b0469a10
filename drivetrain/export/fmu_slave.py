"""The class inside an FMU: pythonfmu calls it, and it calls ``fmu.AxisRun``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from drivetrain.export.fmu import AXIS_FILE, INPUTS, OUTPUTS, AxisRun, read_axis
from drivetrain.study.model import pair_name
from drivetrain.version import __version__


class DriveSlave(Fmi2Slave):
    """The drive of one axis, read from the axis file in the FMU."""

    held: ClassVar[list[Any]] = []

    def __init__(self, **given: Any):
        super().__init__(**given)
        self.axis = read_axis((Path(self.resources) / AXIS_FILE).read_text(encoding="utf-8"))
        self.description = f"{pair_name(self.axis.motor.key, self.axis.gear.key)} at {self.axis.joint}"
        self.version = __version__
        parameters = self.axis.parameters()
        self.parameters = {name: value for name, (value, _, _) in parameters.items()}
        self.inputs = dict.fromkeys(INPUTS, 0.0)
        self.units: dict[str, str] = {}
        for name, (_, unit, meaning) in parameters.items():
            self._add(name, unit, meaning, self.parameters, "parameter")
        for name, (unit, meaning) in INPUTS.items():
            self._add(name, unit, meaning, self.inputs, "input")
        self.run, self.start = AxisRun(self.axis), 0.0
        self.outputs = self.run.now(self.inputs)
        for name in self.outputs:
            self._add(name, *OUTPUTS[name], self.outputs, "output")

    def _add(self, name: str, unit: str, meaning: str, values: dict[str, float], causality: str) -> None:
        self.units[name] = self.axis.unit(name, unit)
        fixed = causality == "parameter"
        self.register_variable(
            Real(name, causality=Fmi2Causality[causality], description=meaning,
                 variability=Fmi2Variability.fixed if fixed else Fmi2Variability.continuous,
                 initial=Fmi2Initial.exact if fixed else None,
                 getter=partial(values.__getitem__, name), setter=partial(values.__setitem__, name)),
            nested=False,
        )  # fmt: skip

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        self.start = start_time

    def exit_initialization_mode(self) -> None:
        self.run = AxisRun(self.axis.with_parameters(self.parameters))
        self.outputs.update(self.run.now(self.inputs))

    def do_step(self, current_time: float, step_size: float) -> bool:
        try:
            self.outputs.update(self.run.run(self.inputs, current_time + step_size - self.start))
        except ArithmeticError as error:
            self.log(str(error), Fmi2Status.error)
            return False
        return True

    def to_xml(self, model_options: dict[str, str] | None = None) -> ElementTree.Element:
        """The model description of pythonfmu with units and the initial unknowns that the standard requires."""
        root = super().to_xml(model_options or {})
        units = ElementTree.Element("UnitDefinitions")
        for unit in sorted({*self.units.values()} - {"1"}):
            ElementTree.SubElement(units, "Unit", name=unit)
        root.insert([one.tag for one in root].index("CoSimulation") + 1, units)
        for variable in root.iter("ScalarVariable"):
            unit = self.units[variable.attrib["name"]]
            if unit != "1":
                variable[0].set("unit", unit)
        structure = next(root.iter("ModelStructure"))
        unknown = ElementTree.SubElement(structure, "InitialUnknowns")
        unknown.extend(list(structure[0]))  # the initial unknowns are the outputs
        return root
