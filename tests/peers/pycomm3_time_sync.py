"""Reads the Time Sync object (class 0x43) of a device with pycomm3, and tells when each answer came.

Prints one JSON object: attribute number -> hex of its value, or the error; `before` and `after` are the host's clock (ns) around the
reading of the system time. With further arguments N=HEX these attributes are set first. `class N` are attributes of the class of the
Motion Device Axis Object (0x42).
"""

import json
import sys
import time

from pycomm3 import CIPDriver


def message(driver, service, attribute, data=b"", class_code=0x43, instance=1):
    return driver.generic_message(
        service=service,
        class_code=class_code,
        instance=instance,
        attribute=attribute,
        request_data=data,
        connected=False,
        unconnected_send=False,
        route_path=False,
        name="request",
    )


def main():
    address, *settings = sys.argv[1:]
    found = {}
    with CIPDriver(address) as driver:
        for setting in settings:
            attribute, value = setting.split("=")
            of, number = (0x42, 0) if attribute.startswith("class ") else (0x43, 1)
            answer = message(driver, b"\x10", int(attribute.removeprefix("class ")), bytes.fromhex(value), of, number)
            found["set " + attribute] = answer.error or "done"
        for attribute in range(1, 29):
            before = time.clock_gettime_ns(time.CLOCK_REALTIME)
            answer = message(driver, b"\x0e", attribute)
            after = time.clock_gettime_ns(time.CLOCK_REALTIME)
            found[str(attribute)] = answer.value.hex() if answer.error is None else "error: " + answer.error
            if attribute == 4:
                found["before"], found["after"] = before, after
        for attribute in (2, 3, 4, 5, 6, 7, 28, 29, 30):
            answer = message(driver, b"\x0e", attribute, class_code=0x42, instance=0)
            found["class %d" % attribute] = answer.value.hex() if answer.error is None else "error: " + answer.error
    print(json.dumps(found))


main()
