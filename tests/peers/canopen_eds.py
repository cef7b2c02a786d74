"""What PyPI's canopen makes of data sheets and configurations of CANopen devices.

Usage: canopen_eds.py NODE FILE... Prints one JSON object: of each file its objects, or the error that it was refused with;
judged by tests/device_descriptions.rs.
"""

import json
import sys

from canopen.objectdictionary import ODArray, ODRecord, ODVariable
from canopen.objectdictionary.eds import import_eds


def plain(value):
    if isinstance(value, bytes):
        return {"bytes": value.hex()}
    return value


def described(variable):
    return {
        "name": variable.name,
        "type": variable.data_type,
        "access": variable.access_type,
        "pdo": variable.pdo_mappable,
        "default": plain(variable.default),
        "value": plain(variable.value),
        "low": variable.min,
        "high": variable.max,
    }


def objects(dictionary):
    found = {}
    for index, thing in dictionary.items():
        # Stand-ins for gaps of a mapping are data types, no objects.
        if index < 0x1000:
            continue
        if isinstance(thing, ODVariable):
            found[f"{index:04X}"] = {"kind": "variable", "name": thing.name, "subs": {"0": described(thing)}}
            continue
        kind = {ODArray: "array", ODRecord: "record"}[type(thing)]
        subs = {str(sub): described(variable) for sub, variable in thing.subindices.items()}
        found[f"{index:04X}"] = {"kind": kind, "name": thing.name, "subs": subs}
    return found


def main():
    node = int(sys.argv[1])
    answer = {}
    for name in sys.argv[2:]:
        try:
            encoding = "latin-1" if "latin1" in name else "utf-8"
            with open(name, encoding=encoding) as source:
                dictionary = import_eds(source, node)
            device = dictionary.device_information
            answer[name] = {
                "objects": objects(dictionary),
                "vendor": [device.vendor_name, device.vendor_number],
                "product": [device.product_name, device.product_number, device.revision_number, device.order_code],
                "rates": sorted(device.allowed_baudrates),
                "pdos": [device.nr_of_RXPDO, device.nr_of_TXPDO],
                "bit_rate": dictionary.bitrate,
            }
        except Exception as error:  # whatever it is, the test says what it makes of it
            answer[name] = {"error": f"{type(error).__name__}: {error}"}
    json.dump(answer, sys.stdout)


main()
