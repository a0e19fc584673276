# SPDX-License-Identifier: Apache-2.0
"""A browser in front of `striper serve --to web:`: Debian's Chromium, driven by Debian's selenium."""
import json
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from web_test import Served  # noqa: E402

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import Select
except ImportError:
    webdriver = By = Keys = Select = None

CHROMEDRIVER = "/usr/bin/chromedriver"
FLAGS = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--window-size=1280,1000")


@unittest.skipUnless(webdriver and os.path.exists(CHROMEDRIVER),
                     "NO BROWSER HAS SEEN THE PAGES: chromium, chromium-driver or python3-selenium is not installed")
class Browsed(Served):
    """Finds things as people do who hear or see the page: by role and name."""

    def setUp(self):
        super().setUp()
        options = webdriver.ChromeOptions()
        for flag in FLAGS:
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(service=Service(CHROMEDRIVER), options=options)
        self.addCleanup(self.browser.quit)

    def visit(self, page="/"):
        self.browser.get(f"http://127.0.0.1:{self.port}{page}")

    def run_js(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def data(self, name):
        return self.run_js("return document.body?.getAttribute(arguments[0])", "data-" + name)  # A page may go meanwhile.

    def wait_for(self, what, why, seconds=20):
        end = time.monotonic() + seconds
        while not what():
            self.assertLess(time.monotonic(), end, f"{why}: {self.data('state')}, {self.text('notice')}")
            time.sleep(0.05)

    def wait_for_state(self, state, seconds=20):
        self.wait_for(lambda: self.data("state") == state, f"it is not {state}", seconds)

    def wait_for_text(self, element, text, seconds=20):
        self.wait_for(lambda: text in self.text(element), f"'{text}' is not in {element}", seconds)

    def text(self, element):
        return self.run_js("return document.getElementById(arguments[0])?.textContent ?? ''", element)

    def named(self, tag, name):
        """The element of that accessible name."""
        found = [one for one in self.browser.find_elements(By.CSS_SELECTOR, tag) if one.accessible_name == name]
        self.assertEqual(len(found), 1, f"{tag} '{name}'")
        return found[0]

    def press(self, name):
        self.named("button", name).click()

    def choose(self, name, value):
        Select(self.named("select", name)).select_by_value(value)

    def events(self):
        return [one.get_attribute("data-code") for one in self.browser.find_elements(By.CSS_SELECTOR, "#events li")]

    def log_in(self):
        with open(self.path("state", "token"), encoding="ascii") as file:
            token = file.read().strip()
        self.press("Log in")
        self.browser.find_element(By.ID, "token").send_keys(token, Keys.ENTER)
        self.wait_for(lambda: self.data("access") == "change", "it is not logged in")

    def pixels_of(self, canvas="above"):
        """How many pixels of a canvas are of no background, and all of them as text."""
        return self.run_js("""const c = document.getElementById(arguments[0]);
            const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
            let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return [n, c.toDataURL()];""", canvas)

    def counts(self):
        """Returns by reason, as the page says."""
        items = self.run_js("return [...document.querySelectorAll('#reasons li')].map((one) => [one.dataset.status, one.textContent])")
        return {status: int(text.split()[-1]) for status, text in items}

    def why(self):
        """The rows of "Why this range"."""
        return dict(self.run_js("""return [...document.querySelectorAll('#why dt')].map((one) => [one.textContent, one.nextElementSibling.textContent])"""))

    def errors(self):
        return [one["message"] for one in self.browser.get_log("browser") if one["level"] == "SEVERE"]

    def look(self, width, height, is_dark=False):
        """As a window of that size, in that style."""
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}]
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})

    def keep_screenshot(self, name):
        if "SCREENSHOTS" in os.environ:
            self.browser.save_screenshot(os.path.join(os.environ["SCREENSHOTS"], name + ".png"))

    def status(self):
        return json.loads(self.get("/api/v1/status")[1])


del Served  # Or its tests are run where this is imported.
