"""Controls an axis from the page of a gateway in headless Chromium: logs in, jogs, moves, stops, and closes the page while it jogs.

    page_control.py CHROMIUM URL FOLDER TOKEN CERTIFICATE SOCKET

The browser does not know the certificate of the gateway, and is made to accept it.

Prints one JSON object: for each kind of jog the highest speed, how long the axis took to rest after the end, and its speed a second later.
Screenshots go to FOLDER.
"""

import json
import socket
import ssl
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from page import FAINT, LIVE, VIEW, Browser

SAYS = "document.getElementById('control-says').textContent"
JOG = "document.getElementById('{}')"


def axis(url):
    """The first axis as the gateway reads its drive."""
    trust = urllib.request.HTTPSHandler(context=ssl.create_default_context(cafile=sys.argv[5]))
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), trust)
    with opener.open(f"{url}api/v1/status", timeout=20) as answer:
        return json.load(answer)["axes"][0]


def mouse(browser, kind, name):
    """Presses or releases the mouse in the middle of a button."""
    browser.value(f"document.getElementById('{name}').scrollIntoView({{ block: 'center' }})")
    middle = f"(() => {{ const box = document.getElementById('{name}').getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
    x, y = browser.value(middle)
    browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1 if kind == "mousePressed" else 0, clickCount=1)


def click(browser, name):
    mouse(browser, "mousePressed", name)
    mouse(browser, "mouseReleased", name)


def key(browser, kind, name, code):
    browser.call("Input.dispatchKeyEvent", type=kind, key=name, code="Space" if name == " " else name, windowsVirtualKeyCode=code)


def watch(url, seconds):
    """The highest speed within this time."""
    fastest, end = 0.0, time.monotonic() + seconds
    while time.monotonic() < end:
        fastest = max(fastest, abs(axis(url)["velocity"]))
        time.sleep(0.02)
    return fastest


def jog(url, begin, end, after=None):
    """Begins a jog, ends it, and looks at the axis."""
    begin()
    fastest = watch(url, 1.0)
    began = time.monotonic()
    end()
    while abs(axis(url)["velocity"]) > 0.05 and time.monotonic() < began + 20:
        time.sleep(0.01)
    rest = (time.monotonic() - began) * 1000
    later = watch(url, 1.0)
    if after:
        after()
    return {"fastest": fastest, "rest_ms": rest, "later": later, "state": axis(url)["state"]}


def open_stream(browser):
    browser.until("!document.getElementById('take-control').disabled", "control is offered")
    click(browser, "take-control")
    browser.until("!document.getElementById('enable').disabled", "control")


def take_control(browser):
    open_stream(browser)
    click(browser, "enable")
    browser.until("!document.getElementById('jog-plus').disabled", "the axis is enabled")


def pictures(browser, folder):
    for scheme in ("light", "dark"):
        for size in ("desk", "phone"):
            browser.look(scheme, size)
            browser.value("document.getElementById('axis-control').closest('section').scrollIntoView()")
            time.sleep(0.3)
            browser.picture(folder / f"control-{scheme}-{size}.png")
    wide = browser.value("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1")
    faint = browser.value(FAINT)
    browser.look("light", "desk")
    return wide, faint + browser.value(FAINT)


def main():
    chromium, url, folder, token = sys.argv[1], sys.argv[2], Path(sys.argv[3]), sys.argv[4]
    folder.mkdir(parents=True, exist_ok=True)
    report = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(chromium, profile, ["--ignore-certificate-errors"])
        try:
            browser.open(f"{url}#/axis/turntable", f"!!{VIEW} && {VIEW}.id === 'view-axis'")
            # The question whether control is offered has failed: it is asked again.
            browser.until("control.offer !== null", "the offer of control")
            browser.value("control.offer = null")
            browser.until("control.offer !== null", "the offer of control once more")
            for secret in ("not-the-right-token", token):
                browser.until("document.querySelector('#token')?.checkVisibility() ?? false", "the login")
                browser.value("document.getElementById('token').focus()")
                browser.call("Input.insertText", text=secret)
                browser.key("Enter", 13, "\r")
                if secret != token:
                    browser.until(f"{SAYS}.startsWith('Not logged in')", "the refusal")
                    report["wrong"] = browser.value(SAYS)
            take_control(browser)
            browser.value("document.getElementById('control-velocity').value = '1'")
            browser.value("document.getElementById('control-acceleration').value = '20'")

            report["mouse"] = jog(
                url, lambda: mouse(browser, "mousePressed", "jog-plus"), lambda: mouse(browser, "mouseReleased", "jog-plus"))
            before = axis(url)["position"]
            browser.value("document.getElementById('jog-minus').focus()")
            report["keys"] = jog(url, lambda: key(browser, "keyDown", " ", 32), lambda: key(browser, "keyUp", " ", 32))
            report["turned"] = axis(url)["position"] - before
            browser.value("document.getElementById('enable').focus()")
            report["arrows"] = jog(
                url, lambda: key(browser, "keyDown", "ArrowRight", 39), lambda: key(browser, "keyUp", "ArrowRight", 39))
            # The window loses the focus while the button is down, and is still down.
            report["blur"] = jog(
                url, lambda: mouse(browser, "mousePressed", "jog-plus"), lambda: browser.value("window.dispatchEvent(new Event('blur'))"),
                lambda: mouse(browser, "mouseReleased", "jog-plus"))
            # Escape stops, whatever is held.
            report["stop"] = jog(
                url, lambda: mouse(browser, "mousePressed", "jog-plus"), lambda: browser.key("Escape", 27),
                lambda: mouse(browser, "mouseReleased", "jog-plus"))
            browser.value("document.getElementById('control-position').value = '0.25'")
            click(browser, "move-to")
            browser.until(f"{SAYS} === 'move: done'", "the move")
            report["moved"] = axis(url)["position"]
            report["wide"], report["faint"] = pictures(browser, folder)

            # The events end, and the stream of control lives: the axis keeps its torque.
            browser.value("source.close(); source.dispatchEvent(new Event('error'))")
            browser.until("document.body.classList.contains('stale')", "the end of the events")
            browser.until(f"{LIVE} && !isAnew", "the next events")
            time.sleep(1.0)
            report["kept"] = [axis(url)["state"], axis(url)["owner"], browser.value("control.socket !== null && !document.getElementById('stop-bar').hidden")]

            # Another view gives control back.
            browser.value("window.location.hash = '#/time'")
            browser.until(f"{VIEW}.id === 'view-time' && document.getElementById('stop-bar').hidden", "another view")
            report["view"] = browser.value("control.said.text")
            browser.value("window.location.hash = '#/axis/turntable'")
            browser.until(f"{VIEW}.id === 'view-axis'", "the axis")
            open_stream(browser)
            browser.until(f"{SAYS} === 'You can enable the axis: nobody has it.'", "an axis that nobody has")
            # Another client takes the axis first.
            with socket.socket(socket.AF_UNIX) as other:
                other.connect(sys.argv[6])
                other.sendall(b"enable turntable\n")
                report["other_has"] = other.recv(200).decode()
                browser.until(f"document.getElementById('stop-bar').hidden && {SAYS}.startsWith('Another client')", "the other client")
                report["state_of_other"] = axis(url)["state"]
            take_control(browser)
            browser.value("document.getElementById('control-velocity').value = '1'")
            browser.value("document.getElementById('control-acceleration').value = '20'")
            mouse(browser, "mousePressed", "jog-plus")
            report["closing"] = watch(url, 1.0)
            report["complaints"] = browser.complaints
            browser.session = None
            browser.call("Target.closeTarget", targetId=browser.target)
            time.sleep(1.5)
        finally:
            browser.process.kill()
            browser.process.wait()
    print(json.dumps(report))


main()
