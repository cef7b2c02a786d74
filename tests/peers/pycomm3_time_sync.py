"""Reads the Time Sync object (class 0x43) of a device with pycomm3, and tells when each answer came.

Prints one JSON object: attribute number -> hex of its value, or the error; `before` and `after` are the host's clock (ns) around the
reading of the system time. With further arguments N=HEX these attributes are set first. `class N` are attributes of the class of the
Motion Device Axis Object (0x42).
"""

import json
import sys
import time

from explicit import request
from pycomm3 import CIPDriver


def main():
    address, *settings = sys.argv[1:]
    found = {}
    with CIPDriver(address) as driver:
        for setting in settings:
            attribute, value = setting.split("=")
            of, number = (0x42, 0) if attribute.startswith("class ") else (0x43, 1)
            answer = request(driver, b"\x10", of, number, int(attribute.removeprefix("class ")), bytes.fromhex(value))
            found["set " + attribute] = answer.error or "done"
        for attribute in range(1, 29):
            before = time.clock_gettime_ns(time.CLOCK_REALTIME)
            answer = request(driver, b"\x0e", 0x43, 1, attribute)
            after = time.clock_gettime_ns(time.CLOCK_REALTIME)
            found[str(attribute)] = answer.value.hex() if answer.error is None else "error: " + answer.error
            if attribute == 4:
                found["before"], found["after"] = before, after
        for attribute in (2, 3, 4, 5, 6, 7, 28, 29, 30):
            answer = request(driver, b"\x0e", 0x42, 0, attribute)
            found["class %d" % attribute] = answer.value.hex() if answer.error is None else "error: " + answer.error
    print(json.dumps(found))


main()
