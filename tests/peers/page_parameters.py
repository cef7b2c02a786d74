"""Reads and writes parameters of drives on the page of a gateway in headless Chromium.

    page_parameters.py CHROMIUM URL FOLDER TOKEN AXISBRIDGE SOCKET

Prints one JSON object: what the rows of the page show, and what `axisbridge param` says of the same drive meanwhile. Screenshots go to
FOLDER.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from page import FAINT, VIEW, Browser

GAIN = "S-0-0104"
NOTE = "document.getElementById('parameter-note')?.textContent"
# Of a drive on CANopen and one on DeviceNet: axis, parameter, new value.
OTHERS = [("slide", "6081:00", "1234"), ("spindle", "66.1.504", "150")]
SAYS = "document.getElementById('parameter-says').textContent"
# Of a parameter with a name, and of a drive that has taken a value and kept another.
REPLIES = [
    ("ok", "notch_frequency=120000 unit=mHz"),
    ("error", "not-kept: the drive took S-0-0104 = 2.00 and has 1.99 afterwards"),
]


def line(parameter):
    """The row of a parameter on the page; nothing while it is not shown."""
    return f"document.getElementById('parameter-{parameter}')"


def text(parameter, column, part=".value"):
    return f"{line(parameter)}?.children[{column}].querySelector('{part}').textContent"


def form(parameter):
    return f"({line(parameter)}?.querySelector('form')?.checkVisibility() ?? false)"


def param(word, *rest, axis="turntable"):
    """The drive as another process sees it."""
    command = [sys.argv[5], "param", word, axis, *rest, "--local", sys.argv[6]]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    if done.returncode:
        raise SystemExit(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


def value(parameter, axis="turntable"):
    return json.loads(param("read", parameter, "--json", axis=axis))["value"]


def show(browser, axis, parameter):
    """Opens the parameters of an axis, and looks for one: with the keyboard alone."""
    browser.value(f"window.location.hash = '#/axis/{axis}'")
    browser.until(f"{VIEW}.id === 'view-axis' && axisView.name === '{axis}' && !!document.getElementById('parameter-filter')", axis)
    before = browser.value("performance.getEntriesByType('resource').filter((one) => one.name.includes('/api/v1/parameter')).length")
    browser.value("document.getElementById('parameter-filter').focus()")
    browser.until(f"({NOTE} || '').includes('parameters, from')", "the list")
    browser.call("Input.insertText", text=parameter)
    browser.until(f"document.querySelectorAll('#parameter-rows tr').length === 1 && !!{line(parameter)}", parameter)
    browser.until(f"/\\d/.test({text(parameter, 1)})", "a value")
    return before


def row(browser, parameter):
    cells = [browser.value(text(parameter, column)) for column in range(4)]
    return {"name": browser.value(text(parameter, 0, ".more")), "cells": cells}


def write(browser, parameter, wanted):
    """Types a value and presses Enter: what the page says then."""
    browser.value(f"{line(parameter)}.querySelector('form input').value = ''")
    browser.value(f"{line(parameter)}.querySelector('form input').focus()")
    browser.call("Input.insertText", text=wanted)
    result = text(parameter, 4, "td > .more")
    browser.value(f"knownOf('{parameter}').result = null; showParameters()")
    browser.key("Enter", 13, "\r")
    browser.until(f"/^(Kept|Not kept|Refused)/.test({result})", "the result of a write")
    return browser.value(result)


def answered(browser, verdict, rest):
    """What the page says of a write with this reply."""
    browser.value(f"parameters.write = {{ id: '{GAIN}' }}; hearWrite('{verdict}', '{rest}')")
    return browser.value(f"knownOf('{GAIN}').result.text")


def log_in(browser, token):
    browser.value("document.getElementById('token').focus()")
    browser.call("Input.insertText", text=token)
    browser.key("Enter", 13, "\r")
    take_control(browser)


def take_control(browser):
    browser.until("!document.getElementById('take-control').disabled", "control is offered")
    browser.value("document.getElementById('take-control').focus()")
    browser.key("Enter", 13, "\r")
    browser.until("!document.getElementById('enable').disabled", "control")


def pictures(browser, folder):
    wide = False
    faint = []
    for scheme in ("light", "dark"):
        for size in ("desk", "phone"):
            browser.look(scheme, size)
            browser.value("document.getElementById('axis-parameters').closest('section').scrollIntoView()")
            time.sleep(1.5)
            browser.picture(folder / f"parameters-{scheme}-{size}.png")
            wide = wide or browser.value("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1")
            faint += browser.value(FAINT)
    browser.look("light", "desk")
    return wide, faint


def main():
    chromium, url, folder, token = sys.argv[1], sys.argv[2], Path(sys.argv[3]), sys.argv[4]
    folder.mkdir(parents=True, exist_ok=True)
    report = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(chromium, profile)
        try:
            browser.open(f"{url}#/axis/turntable", f"!!{VIEW} && {VIEW}.id === 'view-axis'")
            time.sleep(2)
            asked = [one for one in browser.requests if "/api/v1/parameter" in one]
            report["before"] = len(asked)
            show(browser, "turntable", GAIN)
            report["gain"] = row(browser, GAIN)
            report["says"] = browser.value(SAYS)
            report["form_without_token"] = browser.value(form(GAIN))
            browser.value(f"writeParameter({{ id: '{GAIN}' }}, '9')")
            time.sleep(1)
            report["without_token"] = value(GAIN)

            log_in(browser, token)
            browser.until(form(GAIN), "a field for the new value")
            report["kept"] = write(browser, GAIN, "2.5")
            report["after_kept"] = value(GAIN)
            browser.until(f"{text(GAIN, 1)}.startsWith('2.50')", "the value is read again")
            report["refused"] = write(browser, GAIN, "0")
            report["after_refused"] = value(GAIN)
            # Replies as the gateway makes them, of what this drive does not do.
            report["replies"] = [answered(browser, *reply) for reply in REPLIES]
            # Another one writes: the page shows it within seconds.
            param("write", GAIN, "4")
            began = time.monotonic()
            browser.until(f"{text(GAIN, 1)}.startsWith('4.00')", "what another one has written")
            report["seen_after_s"] = time.monotonic() - began
            report["gain_after"] = row(browser, GAIN)

            # What is the gateway's has no field.
            browser.value("document.getElementById('parameter-filter').value = ''")
            browser.value("document.getElementById('parameter-filter').focus()")
            browser.call("Input.insertText", text="S-0-0047")
            browser.until(f"!!{line('S-0-0047')} && /\\d/.test({text('S-0-0047', 1)})", "a set-point")
            report["command"] = row(browser, "S-0-0047")
            report["form_of_command"] = browser.value(form("S-0-0047"))

            # Rows on the screen and no others are read.
            browser.value("document.getElementById('parameter-filter').value = 'position'")
            browser.value("document.getElementById('parameter-filter').dispatchEvent(new Event('input'))")
            browser.value("document.getElementById('axis-parameters').closest('section').scrollIntoView()")
            browser.until("document.querySelectorAll('#parameter-rows tr').length > 15", "many rows")
            time.sleep(6)
            report["rows"] = browser.value("parameters.lines.length")
            report["read"] = browser.value("parameters.lines.filter((line) => knownOf(line.listed.id).at > -Infinity).length")
            report["on_screen"] = browser.value("parameters.lines.filter((line) => line.node.isOnScreen).length")
            report["wide"], report["faint"] = pictures(browser, folder)

            browser.value("document.getElementById('enable').click()")
            browser.until("control.state === 'operating'", "torque")
            browser.until(f"{SAYS}.includes('torque')", "why nothing is written")
            report["with_torque"] = browser.value("parameters.lines.every((line) => line.submit.disabled)")
            browser.value("document.getElementById('disable').click()")
            browser.until("control.state !== 'operating'", "no torque")

            report["others"] = {}
            for axis, parameter, wanted in OTHERS:
                show(browser, axis, parameter)
                seen = report["others"][axis] = row(browser, parameter)
                seen["form_without_control"] = browser.value(form(parameter))
                take_control(browser)
                browser.until(form(parameter), "a field for the new value")
                seen["before"] = value(parameter, axis)
                seen["said"] = write(browser, parameter, wanted)
                seen["after"] = value(parameter, axis)
                browser.until(f"{text(parameter, 1)}.startsWith('{seen['after']}')", "the value is read again")
            report["complaints"], report["requests"] = browser.complaints, browser.requests
        finally:
            browser.process.kill()
            browser.process.wait()
    print(json.dumps(report))


main()
