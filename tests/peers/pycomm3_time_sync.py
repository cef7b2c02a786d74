"""Reads the Time Sync object (class 0x43) of a device with pycomm3, and tells when each answer came.

Prints one JSON object: attribute number -> hex of its value, or the error; `before` and `after` are the host's clock (ns) around the
reading of the system time. With further arguments N=HEX these attributes are set first.
"""

import json
import sys
import time

from pycomm3 import CIPDriver


def message(driver, service, attribute, data=b""):
    return driver.generic_message(
        service=service,
        class_code=0x43,
        instance=1,
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
            answer = message(driver, b"\x10", int(attribute), bytes.fromhex(value))
            found["set " + attribute] = answer.error or "done"
        for attribute in range(1, 29):
            before = time.clock_gettime_ns(time.CLOCK_REALTIME)
            answer = message(driver, b"\x0e", attribute)
            after = time.clock_gettime_ns(time.CLOCK_REALTIME)
            found[str(attribute)] = answer.value.hex() if answer.error is None else "error: " + answer.error
            if attribute == 4:
                found["before"], found["after"] = before, after
    print(json.dumps(found))


main()
