"""Looks at an axis on the page of a gateway in headless Chromium while the gateway starts again with another configuration.

    page_restart.py CHROMIUM URL CONFIG PROCESS

Prints one JSON object: what the views of the axis show of a drive that is lost, and the limits before and after the restart.
"""

import json
import os
import signal
import sys
import tempfile
from pathlib import Path

from page import VIEW, Browser

LIMITS = "(axisView.limits ? axisView.limits.textContent : '')"
VELOCITY = "document.getElementById('control-velocity').value"
# The next question about an axis fails.
FAIL_ONCE = (
    "(() => { const answered = window.fetch; window.failed = 0; window.fetch = (path, ...more) => {"
    " if (window.failed > 0 || !path.startsWith('/api/v1/axis?')) return answered(path, ...more);"
    " window.failed += 1; return Promise.reject(new TypeError('on purpose')); }; })()")
LOST = "{ ...last, status: { ...last.status, axes: last.status.axes.map((axis) => ({ ...axis, inhibits: ['no_drive'] })) } }"


def main():
    chromium, url, config, process = sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4])
    report = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(chromium, profile)
        try:
            browser.open(f"{url}#/mapping/turntable", f"!!{VIEW} && {VIEW}.id === 'view-mapping' && mappingView.live.length > 0")
            report["mapping"] = browser.value(f"(() => {{ showMapping({LOST}, 'turntable'); return mappingView.table.innerText; }})()")
            browser.value(FAIL_ONCE)
            browser.value("window.location.hash = '#/mapping/slide'")
            browser.until("mappingView.name === 'slide' && mappingView.live.length > 0", "the mapping after a question that failed")
            report["failed"] = [browser.value("window.failed")]
            browser.value("window.failed = 0; window.location.hash = '#/axis/turntable'")
            browser.until(f"{LIMITS}.includes('10.000 rev/s')", "the limits")
            report["failed"].append(browser.value("window.failed"))
            browser.until("axisView.samples.lists !== null", "the last minute")
            # A torque and a velocity that no telegram has.
            report["absent"] = browser.value(
                "(() => { const { lists } = axisView.samples; const kept = { ...lists }; lists.torque = [null]; lists.velocity = [null];"
                " showAxisValues(last.status.axes[0]); Object.assign(lists, kept); const text = axisView.values.innerText;"
                " showAxisValues(last.status.axes[0]); return text; })()")
            report["values"], report["limits"] = browser.value(
                f"(() => {{ showAxis({LOST}, 'turntable'); return [axisView.values.innerText, axisView.limits.innerText]; }})()")
            report["before"] = browser.value(VELOCITY)
            config.write_text(config.read_text().replace("velocity = 10.0", "velocity = 12.0", 1))
            os.kill(process, signal.SIGHUP)
            browser.until(f"{LIMITS}.includes('12.000 rev/s')", "the limits of the other configuration")
            report["after"] = browser.value(VELOCITY)
        finally:
            browser.process.kill()
            browser.process.wait()
    print(json.dumps(report))


main()
