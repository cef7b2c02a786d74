"""Opens every view of the page of a gateway in headless Chromium, by the DevTools protocol over a pipe.

    page.py CHROMIUM URL FOLDER

Prints one JSON object: what each view shows, what the console and the network said, what Tab and Enter reach. Screenshots go to FOLDER.
"""

import base64
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PATIENCE = 60.0
VIEWS = ["#/", "#/axis/turntable", "#/bus/SERCOS", "#/bus/CAN%20bus%201", "#/bus/DeviceNet%201", "#/time", "#/mapping/slide", "#/downloads"]
SIZES = {"desk": (1280, 900, False), "phone": (390, 844, True)}


class Browser:
    """A browser, and what it has reported."""

    def __init__(self, chromium, profile, more=()):
        to_read, self.to_browser = os.pipe()
        self.from_browser, to_write = os.pipe()
        arguments = [
            chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--no-default-browser-check",
            f"--user-data-dir={profile}", *more, "--remote-debugging-pipe", "about:blank",
        ]
        # The browser reads commands from descriptor 3 and writes answers to descriptor 4.
        def descriptors():
            os.dup2(to_read, 30), os.dup2(to_write, 31)
            os.dup2(30, 3), os.dup2(31, 4)
            for number in (3, 4):
                os.set_inheritable(number, True)
        self.process = subprocess.Popen(
            arguments, preexec_fn=descriptors, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(to_read), os.close(to_write)
        self.rest, self.number, self.target, self.session = b"", 0, None, None
        self.complaints, self.requests = [], []

    def open(self, url, ready="true"):
        """Opens a page in daylight on a desk, and waits until it is live and `ready`."""
        self.target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Network", "Page"):
            self.call(f"{domain}.enable")
        self.call("Page.bringToFront")
        self.look("light", "desk")
        self.call("Page.navigate", url=url)
        self.until(f"document.readyState === 'complete' && {LIVE} && {ready}", url)

    def messages(self, seconds):
        ready, _, _ = select.select([self.from_browser], [], [], seconds)
        if not ready:
            return []
        data = os.read(self.from_browser, 1 << 20)
        if not data:
            raise SystemExit("the browser has ended")
        *whole, self.rest = (self.rest + data).split(b"\0")
        return [json.loads(message) for message in whole]

    def take(self, message):
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.complaints.append(f"console: {parameters['args']}")
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(f"exception: {parameters['exceptionDetails']}")
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.complaints.append(f"log: {parameters['entry']}")
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + PATIENCE
        answer = None
        while answer is None and time.monotonic() < end:
            for message in self.messages(1.0):
                if message.get("id") == self.number:
                    answer = message
                else:
                    self.take(message)
        if answer is None or "error" in answer:
            raise SystemExit(f"{method}: {answer}")
        return answer["result"]

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise SystemExit(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def until(self, expression, what):
        end = time.monotonic() + PATIENCE
        while not self.value(expression):
            if time.monotonic() > end:
                raise SystemExit(f"{what}: not within {PATIENCE} s; the page shows {self.value('document.body.innerText')}")
            time.sleep(0.1)

    def key(self, key, code, text=None):
        event = {"key": key, "code": key, "windowsVirtualKeyCode": code}
        if text:
            event["text"] = text
        self.call("Input.dispatchKeyEvent", type="keyDown", **event)
        self.call("Input.dispatchKeyEvent", type="keyUp", **event)

    def look(self, scheme, size):
        width, height, mobile = SIZES[size]
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=mobile)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def picture(self, path):
        shot = self.call("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(shot["data"]))


VIEW = "document.querySelector('.view:not([hidden])')"
LIVE = "!document.body.classList.contains('stale')"
# Where the focus is: the address of a link, or the name of another element.
FOCUS = "(() => { const at = document.activeElement; return at.getAttribute('href') || at.id || at.tagName; })()"
# Texts whose contrast with what is behind them is below 4.5, the least of WCAG 2.1 for texts (1.4.3).
FAINT = """(() => {
  const parse = (text) => { const parts = text.match(/[\\d.]+/g).map(Number); return parts.length < 4 ? [...parts, 1] : parts; };
  const light = ([r, g, b]) => [r, g, b].map((part) => part / 255)
    .map((part) => (part <= 0.03928 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    .reduce((sum, part, index) => sum + part * [0.2126, 0.7152, 0.0722][index], 0);
  const faint = [];
  for (const node of document.querySelectorAll('body *')) {
    const own = [...node.childNodes].some((child) => child.nodeType === 3 && child.textContent.trim());
    if (!own || !node.checkVisibility() || node.closest('.skip, .old, svg, script, noscript')) continue;
    let behind = [255, 255, 255, 0];
    for (let at = node; at && behind[3] === 0; at = at.parentElement) behind = parse(getComputedStyle(at).backgroundColor);
    const [one, other] = [light(parse(getComputedStyle(node).color)), light(behind)].sort((a, b) => b - a);
    const contrast = (one + 0.05) / (other + 0.05);
    if (contrast < 4.5) faint.push(`${node.tagName}.${node.className} ${node.textContent.trim().slice(0, 40)} ${contrast.toFixed(2)}`);
  }
  return faint;
})()"""


def views(browser, url, folder):
    shown = []
    for scheme in ("light", "dark"):
        for size in SIZES:
            browser.look(scheme, size)
            for number, view in enumerate(VIEWS):
                browser.value(f"window.location.hash = {json.dumps(view)}")
                browser.until(f"{LIVE} && {VIEW}.innerText.length > 40", view)
                if "axis" in view or "time" in view:
                    browser.until(f"[...{VIEW}.querySelectorAll('svg path')].some((path) => path.getAttribute('d').length > 60)", view)
                if "mapping" in view:
                    browser.until(f"{VIEW}.querySelectorAll('tbody tr').length > 20", view)
                time.sleep(0.6)
                browser.picture(folder / f"{number}-{scheme}-{size}.png")
                shown.append({
                    "view": view, "scheme": scheme, "size": size, "text": browser.value(f"{VIEW}.innerText"),
                    "title": browser.value("document.title"), "faint": browser.value(FAINT),
                    "wide": browser.value("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"),
                    "background": browser.value("getComputedStyle(document.body).backgroundColor"),
                    "current": browser.value("[...document.querySelectorAll('nav [aria-current]')].map((at) => at.textContent)"),
                })
    return shown


def reload(browser, url):
    """A view by its address alone, as a bookmark opens it."""
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=f"{url}#/axis/slide")
    browser.until(f"document.readyState === 'complete' && {LIVE} && !!{VIEW} && {VIEW}.id === 'view-axis'", "a bookmark")
    browser.call("Page.reload")
    browser.until(f"document.readyState === 'complete' && {LIVE} && !!{VIEW} && {VIEW}.id === 'view-axis'", "a reload")
    return browser.value("document.querySelector('#view-axis h2').textContent")


def keyboard(browser, url):
    """From the overview to every page, and to the axes, with Tab and Enter alone."""
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=url)
    browser.until(f"document.readyState === 'complete' && {LIVE} && !!{VIEW} && {VIEW}.id === 'view-overview'", "the overview")
    order = []
    for _ in range(40):
        browser.key("Tab", 9)
        order.append(browser.value(FOCUS))
        if order[-1] == "BODY":
            break
    reached = {}
    for target in [at for at in dict.fromkeys(order) if at.startswith("#/")]:
        browser.value("window.location.hash = '#/'")
        browser.until(f"{VIEW}.id === 'view-overview'", "the overview")
        browser.value("document.activeElement.blur()")
        for _ in range(60):
            browser.key("Tab", 9)
            if browser.value(FOCUS) == target:
                break
        outline = browser.value("getComputedStyle(document.activeElement).outlineStyle")
        browser.key("Enter", 13, "\r")
        browser.until(f"window.location.hash === {json.dumps(target)}", target)
        browser.until(f"{VIEW}.innerText.length > 20", target)
        time.sleep(0.2)
        reached[target] = {"view": browser.value(f"{VIEW}.id"), "focus": browser.value(FOCUS), "outline": outline}
    browser.value("document.activeElement.blur()")
    browser.value("window.location.hash = '#/time'")
    browser.until(f"{VIEW}.id === 'view-time'", "the skip link")
    browser.call("Page.reload")
    browser.until(f"document.readyState === 'complete' && {LIVE} && !!{VIEW} && {VIEW}.id === 'view-time'", "the skip link")
    browser.key("Tab", 9)
    first = browser.value(FOCUS)
    browser.key("Enter", 13, "\r")
    skip = {"first": first, "focus": browser.value(FOCUS), "hash": browser.value("window.location.hash")}
    return {"order": order, "reached": reached, "skip": skip}


def filtered(browser):
    """Rows of the mapping that are left after typing."""
    browser.value("window.location.hash = '#/mapping/turntable'")
    browser.until(f"{VIEW}.id === 'view-mapping' && {VIEW}.querySelectorAll('tbody tr').length > 20", "the mapping")
    browser.value("document.querySelector('#view-mapping input').focus()")
    browser.call("Input.insertText", text="S-0-0047")
    return browser.value("[...document.querySelectorAll('#view-mapping tbody tr:not([hidden])')].map((row) => row.innerText)")


def main():
    chromium, url, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(chromium, profile)
        try:
            browser.open(url)
            report = {
                "views": views(browser, url, folder), "bookmark": reload(browser, url), "filtered": filtered(browser),
                "keyboard": keyboard(browser, url),
            }
            report["complaints"], report["requests"] = browser.complaints, browser.requests
        finally:
            browser.process.kill()
            browser.process.wait()
    print(json.dumps(report))


if __name__ == "__main__":
    main()
