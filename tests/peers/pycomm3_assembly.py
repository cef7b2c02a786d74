"""What pycomm3 gets from the Assembly object of a device with assemblies, without a connection to them and over class 3.

Usage: pycomm3_assembly.py ADDRESS. Prints one JSON object; judged by tests/foreign_clients.rs.
"""

import json
import sys

from explicit import ask
from pycomm3 import CIPDriver, Services

ASSEMBLY = 0x04
OUTPUT, INPUT, CONFIGURATION = 150, 100, 151
DATA, SIZE = 3, 4


def main(address):
    result = {}
    with CIPDriver(address) as driver:
        def assembly(service, instance, attribute, data=b"", connected=False):
            return ask(driver, service, ASSEMBLY, instance, attribute, data, connected)

        get, put = Services.get_attribute_single, Services.set_attribute_single
        result["revision"] = assembly(get, 0, 1)
        result["output_size"] = assembly(get, OUTPUT, SIZE)
        result["input_size"] = assembly(get, INPUT, SIZE)
        result["output"] = assembly(get, OUTPUT, DATA)
        result["input"] = assembly(get, INPUT, DATA)
        result["configuration"] = assembly(get, CONFIGURATION, DATA)
        result["connected_input"] = assembly(get, INPUT, DATA, connected=True)
        # ENABLE, as the first word of the output.
        result["set_output"] = assembly(put, OUTPUT, DATA, b"\x01" + bytes(15))
        result["set_input"] = assembly(put, INPUT, DATA, bytes(20))
        result["members"] = assembly(get, OUTPUT, 2)
        result["missing"] = assembly(get, 149, DATA)
    print(json.dumps(result))


if __name__ == "__main__":
    main(sys.argv[1])
