"""A functional mock-up unit of a table of friction over speed and slip (FMI 2.0, co-simulation).

It is C source, compiled by the system's `cc`, and needs nothing on the machine that simulates it.
"""

from __future__ import annotations

import hashlib
import platform
import subprocess
import tempfile
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

from iceslide_fem import __version__
from iceslide_fem.preprocess.wheel.slip_table import SlipTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import OutputError

MODEL = "iceslide_wheel"
SOURCE = Path(__file__).parent / "wheel_fmu.c"
PLATFORMS = {"x86_64": "linux64", "AMD64": "linux64", "aarch64": "linuxaarch64"}
# name, causality, unit, start, description
VARIABLES = (
    ("speed_m_s", "input", "m/s", "{v0}", "speed of the vehicle, {v0} to {v1}"),
    ("slip", "input", "1", "0", "slip ratio: 1 locked, 0 rolling freely"),
    ("load_N", "input", "N", "0", "load of the wheel"),
    ("mu", "output", "1", "", "friction against the motion, over the load"),
    ("force_N", "output", "N", "", "mu times the load"),
)  # fmt: skip
XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{model}" guid="{guid}"
  generationTool="iceslide_fem {version}" description={about} numberOfEventIndicators="0"
  variableNamingConvention="flat">
  <CoSimulation modelIdentifier="{model}" canHandleVariableCommunicationStepSize="true"
    canBeInstantiatedOnlyOncePerProcess="false">
    <SourceFiles><File name="{source}"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="1"><BaseUnit/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
  <ModelVariables>
{variables}
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="4" dependencies="1 2"/>
      <Unknown index="5" dependencies="1 2 3"/>
    </Outputs>
    <InitialUnknowns>
      <Unknown index="4" dependencies="1 2"/>
      <Unknown index="5" dependencies="1 2 3"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def write_fmu(path: Path, table: SlipTable, about: str) -> None:
    """Write the unit of a `table` to `path`; about: what it is, in words.

    Raises OutputError if it cannot be compiled or written.
    """
    source = _source(table)
    guid = hashlib.sha256(source.encode()).hexdigest()[:32]
    source = source.replace("@GUID@", guid)
    description = _description(table, guid, about)
    machine = platform.machine()
    if platform.system() != "Linux" or machine not in PLATFORMS:
        raise OutputError(f"an FMU is compiled on Linux on x86_64 or aarch64, not on {machine}")
    with tempfile.TemporaryDirectory() as folder:
        written, library = Path(folder) / f"{MODEL}.c", Path(folder) / f"{MODEL}.so"
        written.write_text(source, encoding="utf-8")
        command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(written), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True)
        except OSError as error:
            raise OutputError(f"an FMU needs a C compiler: cc: {error.strerror}") from None
        if done.returncode:
            raise OutputError(f"the FMU does not compile: {done.stderr.strip().splitlines()[-1]}")
        try:
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as unit:
                unit.writestr("modelDescription.xml", description)
                unit.write(written, f"sources/{MODEL}.c")
                unit.write(library, f"binaries/{PLATFORMS[machine]}/{MODEL}.so")
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}") from None


def _source(table: SlipTable) -> str:
    def array(values: Array) -> str:
        return "{" + ", ".join(f"{value:.17g}" for value in values.ravel()) + "}"

    text = SOURCE.read_text(encoding="utf-8")
    sizes = {"SPEEDS": table.speeds.size, "SLIPS": table.slips.size}
    for name, size in sizes.items():
        text = text.replace(f"@{name}@", str(size))
    for name, values in (("V", table.speeds), ("S", table.slips), ("MU", table.mu)):
        text = text.replace(f"@{name}@", array(values))
    return text


def _description(table: SlipTable, guid: str, about: str) -> str:
    ends = {"v0": f"{table.speeds[0]:.17g}", "v1": f"{table.speeds[-1]:.17g}"}
    variables = []
    for number, (name, causality, unit, start, text) in enumerate(VARIABLES):
        begins = f' start="{start.format(**ends)}"' if start else ""
        initial = ' initial="calculated"' if causality == "output" else ""
        variables.append(
            f'    <ScalarVariable name="{name}" valueReference="{number}" causality="{causality}" '
            f'variability="continuous"{initial} description={quoteattr(text.format(**ends))}>'
            f'<Real unit="{unit}"{begins}/></ScalarVariable>'
        )
    return XML.format(
        model=MODEL, guid=guid, version=__version__, about=quoteattr(about), source=f"{MODEL}.c",
        variables="\n".join(variables),
    )  # fmt: skip
