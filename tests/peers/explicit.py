"""Explicit requests to a device by pycomm3, for the scripts beside this one."""


def request(driver, service, class_code, instance, attribute=b"", data=b"", connected=False):
    """One request, and the answer as the client has it."""
    return driver.generic_message(
        service=service,
        class_code=class_code,
        instance=instance,
        attribute=attribute,
        request_data=data,
        connected=connected,
        unconnected_send=False,
        route_path=False,
        name="request",
    )


def ask(driver, service, class_code, instance, attribute=b"", data=b"", connected=False):
    """One request; what came back as hexadecimal, or the error as the client words it."""
    answer = request(driver, service, class_code, instance, attribute, data, connected)
    return {"value": answer.value.hex() if answer.value is not None else None, "error": answer.error}
