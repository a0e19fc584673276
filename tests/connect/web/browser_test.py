# SPDX-License-Identifier: Apache-2.0
"""Proves of the page at `/` of `striper serve --to web:` that it shows scans that move in a real browser (Debian's Chromium), that it
tells streaming, stale and lost apart and comes back by itself, and that lasers go off by it.

Run by `./test.sh --only browser`; by hand: STRIPER=... STRIPER_SOURCE_DIR=... /usr/bin/python3 browser_test.py
A picture of the page is left as page.png where SCREENSHOTS says.
"""
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
except ImportError:
    webdriver = None

CHROMEDRIVER = "/usr/bin/chromedriver"


@unittest.skipUnless(webdriver and os.path.exists(CHROMEDRIVER),
                     "NO BROWSER HAS SEEN THE PAGE: chromium, chromium-driver or python3-selenium is not installed")
class Page(Served):
    def setUp(self):
        super().setUp()
        options = webdriver.ChromeOptions()
        for flag in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--window-size=1280,900"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.browser = webdriver.Chrome(service=Service(CHROMEDRIVER), options=options)
        self.addCleanup(self.browser.quit)
        self.browser.get(f"http://127.0.0.1:{self.port}/")

    def data(self, name):
        return self.browser.find_element(By.TAG_NAME, "body").get_attribute("data-" + name)

    def wait_for(self, what, why, seconds=20):
        end = time.monotonic() + seconds
        while not what():
            self.assertLess(time.monotonic(), end, why + ": " + self.data("state"))
            time.sleep(0.05)

    def picture(self):
        """What the canvas shows: how many pixels are of no background, and all of them as text."""
        script = """const c = document.getElementById("above");
            const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
            let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return [n, c.toDataURL()];"""
        return self.browser.execute_script(script)

    def errors(self):
        return [one["message"] for one in self.browser.get_log("browser") if one["level"] == "SEVERE"]

    def test_shows_scans_that_move(self):
        self.wait_for(lambda: self.data("state") == "streaming", "it does not stream")
        self.assertEqual(self.data("page"), "live")
        before = int(self.data("scans"))
        self.wait_for(lambda: int(self.data("scans")) > before + 20, "no scans come")
        (count, first) = self.picture()
        self.assertGreater(count, 500)
        self.wait_for(lambda: self.picture()[1] != first, "the picture stands still")
        canvas = self.browser.find_element(By.ID, "above")
        self.assertEqual(canvas.accessible_name, "scan from above")
        self.assertIn(canvas.aria_role, ("img", "image"))  # Of one meaning.
        self.assertEqual({b.accessible_name for b in self.browser.find_elements(By.TAG_NAME, "button")}, {"Freeze", "Lasers off"})
        freeze = self.browser.find_element(By.ID, "freeze")
        freeze.click()
        time.sleep(0.3)
        (_, frozen) = self.picture()
        time.sleep(0.5)
        self.assertEqual(self.picture()[1], frozen)
        freeze.click()
        self.assertIn("simulated striper", self.browser.find_element(By.ID, "events").text)
        if "SCREENSHOTS" in os.environ:
            self.browser.save_screenshot(os.path.join(os.environ["SCREENSHOTS"], "page.png"))
        self.assertEqual(self.errors(), [])

    def test_switches_lasers_off(self):
        self.wait_for(lambda: self.data("state") == "streaming", "it does not stream")
        self.browser.find_element(By.ID, "lasers_off").click()
        self.wait_for(lambda: "command_taken: lasers off" in self.browser.find_element(By.ID, "events").text, "nothing was told")
        self.assertIn("lasers off", "".join(self.log))

    def test_says_that_it_is_lost_and_comes_back(self):
        self.wait_for(lambda: self.data("state") == "streaming", "it does not stream")
        port = self.port
        self.end()
        self.wait_for(lambda: self.data("state") == "lost", "it does not see that the program has ended", 5)
        self.start(to=f"web:{port}")
        self.wait_for(lambda: self.data("state") == "streaming", "it does not come back")


del Served  # Or it is run here, too.

if __name__ == "__main__":
    unittest.main()
