# SPDX-License-Identifier: Apache-2.0
"""Proves of the pages of `striper serve --to web:`, in a real browser (Debian's Chromium), what docs/console.md says: scans that move; every
control by its accessible name, by keys alone; that the pages tell streaming, stale and lost apart, come back by themselves and say what
happened; that somebody who reads only the page gets along; that nothing stands in the browser's log; and what others judge: axe-core, and
TypeScript the types. How it looks is for people: screenshots of every page are left where SCREENSHOTS says. Other browsers are not here.

Run by `./test.sh --only browser`; by hand: STRIPER=... STRIPER_SOURCE_DIR=... /usr/bin/python3 browser_test.py
"""
import glob
import json
import os
import re
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browsed, By, Keys  # noqa: E402
from web_test import VirtualCamera, judges, small_scene, striper  # noqa: E402

LAMP = "  - {name: lamp, shape: rectangle, size_m: [0.2, 3], position_m: [1.9, 0.4, 0], radiance_w_m2_sr_nm: 100}\n"
PAGES = {"live": "/", "calibrate": "/calibrate", "health": "/health", "settings": "/settings", "recordings": "/recordings"}


class Page(Browsed):
    def test_shows_scans_that_move(self):
        self.visit()
        self.wait_for_state("streaming")
        self.assertEqual(self.data("page"), "live")
        before = int(self.data("scans"))
        self.wait_for(lambda: int(self.data("scans")) > before + 20, "no scans come")
        count, first = self.pixels_of()
        self.assertGreater(count, 500)
        self.wait_for(lambda: self.pixels_of()[1] != first, "the scan stands still")
        self.wait_for(lambda: self.pixels_of("camera")[0] > 500, "the camera shows nothing")
        self.press("Freeze")
        time.sleep(0.3)
        frozen = self.pixels_of()[1]
        time.sleep(0.5)
        self.assertEqual(self.pixels_of()[1], frozen)
        self.press("Freeze")
        self.assertIn("simulated striper", self.text("events"))
        self.assertEqual(self.errors(), [])

    def test_has_what_others_look_for(self):
        self.visit()
        self.wait_for_state("streaming")
        for name in ("scan from above", "camera"):
            self.assertIn(self.named("canvas", name).aria_role, ("img", "image"))  # Of one meaning.
        for name in ("Start", "Stop", "Lasers off", "Freeze", "Record"):
            self.assertEqual(self.named("button", name).aria_role, "button")
        for name in ("Head", "Laser"):
            self.assertIn("combobox", self.named("select", name).aria_role.lower())
        self.assertEqual(self.named("section", "Why this range").aria_role, "region")
        for page, address in PAGES.items():
            self.visit(address)
            self.assertEqual(self.data("page"), page)
            self.wait_for_state("streaming")
            self.assertEqual(self.browser.find_element(By.CSS_SELECTOR, "nav [aria-current=page]").get_attribute("href")[-len(address):], address)
        self.assertEqual(self.errors(), [])

    def test_says_why_by_keys_alone(self):
        self.visit()
        self.wait_for_state("streaming")
        for _ in range(40):  # To the scan, as somebody without a mouse gets there.
            self.browser.switch_to.active_element.send_keys(Keys.TAB)
            if self.browser.switch_to.active_element.get_attribute("id") == "above":
                break
        scan = self.browser.switch_to.active_element
        self.assertEqual(scan.accessible_name, "scan from above")
        scan.send_keys(Keys.ARROW_RIGHT, Keys.ENTER)
        self.wait_for(lambda: "range_m" in self.why(), "it does not say why")
        line = int(self.why()["line"])
        asked = json.loads(self.get(f"/api/v1/why?head=striper&line={line}")[1])
        self.assertEqual(list(self.why()), list(asked))
        self.assertAlmostEqual(float(self.why()["range_m"]), asked["range_m"], delta=0.1)
        scan.send_keys("m", Keys.SHIFT + Keys.ARROW_RIGHT + Keys.NULL, "m")
        self.wait_for(lambda: re.search(r"Distance \d.* ± .*one sigma", self.text("measured")), "it measures nothing")
        frozen = self.named("button", "Freeze")
        scan.send_keys(" ")
        self.assertEqual(frozen.get_attribute("aria-pressed"), "true")
        scan.send_keys(" ", "+", "w", "0", "-")
        self.assertEqual(frozen.get_attribute("aria-pressed"), "false")
        self.assertEqual(self.errors(), [])

    def test_says_why_by_mouse(self):
        self.visit()
        self.wait_for_state("streaming")
        self.wait_for(lambda: self.pixels_of("camera")[0] > 500, "the camera shows nothing")
        for canvas in ("above", "camera"):
            self.browser.find_element(By.ID, canvas).click()  # Its middle.
            self.wait_for(lambda: self.why().get("line", "").startswith(("7", "8")), f"a click on {canvas} does not say why")
            self.run_js("document.querySelector('#why dl').replaceChildren()")
        self.press("Measure")
        box = self.browser.find_element(By.ID, "above")
        for side in (-40, 40):
            click_at(self.browser, box, side, -30)
        self.wait_for_text("measured", "one sigma")
        self.assertEqual(self.errors(), [])

    def test_controls_do_what_they_say(self):
        self.end()
        self.start("--allow-lasers-on")
        self.visit()
        self.wait_for_state("streaming")
        self.press("Lasers off")
        self.wait_for(lambda: "command_taken: lasers off" in self.text("events"), "nothing was told")
        self.assertEqual(self.data("access"), "look")
        self.press("Stop")  # Asks for the secret.
        self.wait_for(lambda: self.run_js("return document.getElementById('login').open"), "it asks for no secret")
        self.browser.find_element(By.ID, "token").send_keys(Keys.ESCAPE)
        self.log_in()
        self.press("Stop")
        self.wait_for_state("stale")
        self.wait_for_text("state", "paused")
        self.assertRegex(self.text("age"), r"is \d+ s old")
        self.press("Start")
        self.wait_for_text("state", "are the lasers on?")  # They stay off until they are switched on.
        self.browser.find_element(By.LINK_TEXT, "Settings").click()
        self.wait_for(lambda: self.browser.find_elements(By.ID, "set_laser") and self.named("input", "laser").is_enabled(), "the laser cannot be switched")
        self.named("input", "laser").click()
        self.wait_for_state("streaming")
        self.assertEqual(self.errors(), [])


def click_at(browser, element, right, down):
    from selenium.webdriver.common.action_chains import ActionChains  # pylint: disable=import-outside-toplevel
    ActionChains(browser).move_to_element_with_offset(element, right, down).click().perform()


class Recovery(Browsed):
    """The page takes up again by itself, and says what happened."""

    def test_striper_gone_and_back(self):
        self.visit()
        self.wait_for_state("streaming")
        port = self.port
        self.end()
        self.wait_for_state("lost", 5)
        self.wait_for_text("age", "old")
        self.assertGreater(self.pixels_of()[0], 500)  # What came last is still there.
        time.sleep(4)
        self.start(to=f"web:{port}")
        self.wait_for_state("streaming")
        self.wait_for(lambda: {"connection_lost", "connection_back", "program_restarted"} <= set(self.events()), "it does not say what happened")
        self.assertEqual(self.errors(), [])

    def test_camera_lost_and_back(self):
        self.end()
        camera = VirtualCamera(self.scene)
        self.start(source=camera.uri())
        self.visit()
        self.wait_for_text("state", "waiting")  # With nothing at all.
        self.assertEqual(self.data("state"), "idle")
        with camera:
            self.wait_for_state("streaming")
            camera.program.kill()
            camera.program.communicate()
            self.wait_for_state("stale")
            self.wait_for(lambda: "source_lost" in self.events(), "it does not say that the camera is lost")
        with camera:
            self.wait_for_state("streaming")
            self.wait_for(lambda: self.events().count("source_back") == 2, "it does not say that the camera is back")
        self.assertEqual(self.errors(), [])

    def test_model_exchanged(self):
        self.visit()
        self.wait_for_state("streaming")
        with open(self.model, encoding="utf-8") as file:
            model = file.read()
        with open(self.model, "w", encoding="utf-8") as file:
            file.write(model + "# Another one.\n")
        self.server.send_signal(signal.SIGHUP)
        self.wait_for(lambda: "model_reloaded" in self.events(), "it does not say that the model is another")
        before = int(self.data("scans"))
        self.wait_for(lambda: int(self.data("scans")) > before + 5, "no scans come")
        self.assertEqual(self.errors(), [])

    def test_window_asleep_for_a_minute(self):
        self.visit()
        self.wait_for_state("streaming")
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "frozen"})
        time.sleep(60)
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "active"})
        self.wait_for(lambda: "window_slept" in self.events(), "it does not say that it slept")
        self.assertRegex(self.text("events"), r"window slept for (5\d|6\d) s")
        self.wait_for_state("streaming", 5)
        self.wait_for(lambda: float(re.search(r"last scan([\d.]+) s on its clock", self.text("facts"))[1]) > 60, "what it shows is old", 5)
        self.assertEqual(self.errors(), [])


class Sources(Browsed):
    """Without a model, with one that has ended, with two lasers, with several heads."""

    def test_without_a_model_there_is_the_stripe(self):
        self.end()
        model, self.model = self.model, None
        self.start()
        self.model = model
        self.visit()
        self.wait_for_state("streaming")
        self.wait_for_text("reading", "Without a model")
        self.assertGreater(self.pixels_of()[0], 500)
        self.wait_for_text("facts", "no ranges, the stripe alone")
        self.browser.find_element(By.ID, "above").send_keys(Keys.ARROW_RIGHT, Keys.ENTER)
        self.wait_for(lambda: self.why().get("range_m") == "none", "it does not say why")
        self.assertEqual(self.errors(), [])

    def test_a_file_that_has_ended(self):
        striper("record", "sim:" + self.scene, "-o", self.path("run.mcap"), "--frames", "120")
        self.end()
        self.start(source=f"mcap:{self.path('run.mcap')}?realtime=yes")
        self.visit()
        self.wait_for_state("streaming")
        self.server.wait(timeout=30)
        self.wait_for_state("lost")
        self.wait_for(lambda: "source_ended" in self.events() or "does not answer" in self.text("events"), "it does not say that the file has ended")
        self.assertGreater(self.pixels_of()[0], 500)
        self.assertEqual(self.errors(), [])

    def test_two_lasers(self):
        self.end()
        scene = small_scene(cadence="0,1,dark")
        second = scene.replace("lasers:\n", "lasers:\n  - {position_m: [0, 0, -0.35], fan_deg: 80, thickness_deg: 0.2, wavelength_nm: 900, pulse_uj: 10.4}\n", 1)
        self.scene = self.write("two.yaml", second)
        striper("simulate", self.scene, "-o", self.path("two"), "--frames", "1")
        self.model = self.path("two", "model.yaml")
        self.start(fps=30)
        self.visit()
        self.wait_for_state("streaming")
        self.wait_for(lambda: [one.get_attribute("value") for one in self.named("select", "Laser").find_elements(By.TAG_NAME, "option")] == ["all", "0", "1"],
                      "the lasers are not offered")
        self.wait_for(lambda: self.run_js("return document.querySelectorAll('#reasons li').length") > 0, "nothing is counted")
        both = sum(self.counts().values())
        self.choose("Laser", "1")
        self.wait_for(lambda: 0 < sum(self.counts().values()) < both, "one laser shows as much as both")
        self.assertEqual(self.errors(), [])


class Person(Browsed):
    """Who reads only the page gets along."""

    def test_sets_the_exposure_of_a_stripe_that_saturates(self):
        self.end()
        self.scene = self.write("bright.yaml", small_scene().replace("pulse_uj: 10.4", "power_mw: 400000").replace("blur_px: 0.5", "blur_px: 2"))
        self.start()
        self.visit()
        self.wait_for_state("streaming")
        self.wait_for(lambda: self.counts().get("saturated", 0) > 50, "nothing saturates")
        self.browser.find_element(By.ID, "above").send_keys(Keys.ARROW_RIGHT, Keys.ENTER)
        self.wait_for_text("why", "What helps: shorten exposure_us, or lower gain_db")
        self.browser.find_element(By.LINK_TEXT, "Settings").click()
        self.wait_for_text("read_only", "log in")
        self.wait_for(lambda: self.browser.find_elements(By.ID, "set_exposure_us"), "the exposure is not there")
        exposure = self.named("input", "exposure_us")
        self.assertFalse(exposure.is_enabled())
        self.log_in()
        self.wait_for(exposure.is_enabled, "it cannot be set")
        shorter = float(exposure.get_attribute("value")) / 100
        exposure.clear()
        exposure.send_keys(str(shorter), Keys.TAB)
        self.wait_for_text("changed", "exposure_us")
        self.assertIn(f"exposure_us={shorter:g}", self.text("command"))
        self.browser.find_element(By.LINK_TEXT, "Live").click()
        self.wait_for(lambda: self.counts().get("ok", 0) > 50 and self.counts().get("saturated", 0) == 0, "it still saturates")
        self.assertEqual(self.errors(), [])

    def test_finds_why_columns_are_masked(self):
        self.end()
        self.scene = self.write("lamp.yaml", small_scene() + LAMP)
        self.start()
        self.visit()
        self.wait_for_state("streaming")
        self.wait_for(lambda: self.counts().get("blind", 0) > 5, "nothing is masked")
        self.assertGreater(self.counts().get("ok", 0), 20)
        for _ in range(8):  # Ten columns at a time, to one of those.
            self.browser.find_element(By.ID, "above").send_keys(Keys.SHIFT + Keys.ARROW_LEFT + Keys.NULL)
            if "blind" in self.text("reading"):
                break
        self.browser.find_element(By.ID, "above").send_keys(Keys.ENTER)
        self.wait_for(lambda: self.why().get("status") == "blind", "it does not say why")
        self.assertIn("ambient light saturates pixels", self.text("why"))
        self.assertIn("What helps: shorten exposure_us, keep light sources", self.text("why"))
        self.assertEqual(self.errors(), [])

    def test_records_and_plays_back(self):
        self.end()
        self.start(fps=20)
        self.visit("/recordings")
        self.wait_for_state("streaming")
        self.log_in()
        self.press("Record")
        self.wait_for(lambda: self.browser.find_elements(By.CSS_SELECTOR, "#recordings li"), "no recording is there")
        name = self.browser.find_element(By.CSS_SELECTOR, "#recordings li").get_attribute("data-name")
        self.wait_for_text("notice", "scans, 0 were lost", 30)
        self.press(f"Info {name}")
        self.wait_for_text("recordings", "it is whole")
        lasts = float(re.search(r"lasts([\d.]+) s", self.text("recordings"))[1])
        self.assertGreater(lasts, 9)
        self.assertLess(lasts, 14)  # Of the frames' clock: what a busy machine was late with is caught up on.
        status, body, headers = self.get_bytes(f"/api/v1/recordings/{name}")
        self.assertEqual((status, headers["Content-Length"]), (200, str(len(body))))
        with open(self.path("state", "recordings", name), "rb") as file:
            self.assertEqual(file.read(), body)
        self.press(f"Play {name}")
        self.wait_for(lambda: self.data("page") == "live" and "playing" in self.text("state"), "it is not played back")
        self.wait_for(lambda: int(self.data("scans")) > 40, "what is played back has no scans")
        self.assertEqual(self.named("select", "Head").get_attribute("value"), "playback")
        self.choose("Head", "striper")
        self.wait_for_state("streaming")
        self.wait_for(lambda: "playing" not in self.text("state"), "the other head is played, too")
        self.assertEqual([head["name"] for head in self.status()["heads"]], ["striper", "playback"])
        self.assertEqual(self.get("/readyz")[0], 200)
        self.visit("/recordings")
        self.press("Stop playing")
        self.wait_for(lambda: len(self.status()["heads"]) == 1, "it goes on playing")
        self.assertEqual(self.errors(), [])


class Readme(Browsed):
    """The README's command for who has run ./demo.sh, with the folders of this test."""

    def test_command_shows_scans(self):
        self.end()
        source_dir = os.environ["STRIPER_SOURCE_DIR"]
        with open(os.path.join(source_dir, "README.md"), encoding="utf-8") as file:
            (command,) = re.findall(r"^build/demo/apps/striper/striper serve '(sim:\S+)' -m (\S+) --to web:8765$", file.read(), re.M)
        with open(os.path.join(source_dir, "demo.sh"), encoding="utf-8") as file:
            self.assertIn(f"striper serve '{command[0]}' -m $results/room/model.yaml --to web:8765", file.read())
        self.assertEqual(command[1], "build/demo-results/room/model.yaml")
        scene = command[0].replace("data/scenes", source_dir + "/data/scenes")
        striper("simulate", scene[len("sim:"):].split("?")[0], "-o", self.path("room"), "--frames", "1")
        self.model = self.path("room", "model.yaml")
        self.start(source=scene)
        self.look(1600, 1000)
        self.visit()
        self.wait_for_state("streaming", 60)
        self.wait_for(lambda: int(self.data("scans")) > 20, "no scans come", 60)
        self.browser.find_element(By.ID, "above").send_keys(Keys.ARROW_RIGHT, Keys.ENTER)
        self.wait_for(lambda: "range_m" in self.why(), "it does not say why")
        self.keep_screenshot("console")
        self.assertEqual(self.errors(), [])


class Judged(Browsed):
    """What others say."""

    def test_types_hold(self):
        work = judges(self, "NOBODY HAS CHECKED THE TYPES")
        page = os.path.join(os.environ["STRIPER_SOURCE_DIR"], "connect/web/page")
        options = ["--allowJs", "--checkJs", "--noEmit", "--strict", "--noUnusedLocals", "--noUnusedParameters", "--target", "ES2022", "--module",
                   "ES2022", "--moduleResolution", "bundler", "--lib", "ES2023,DOM,DOM.Iterable"]
        done = subprocess.run([os.path.join(work, "node_modules/.bin/tsc"), *options, *sorted(glob.glob(page + "/*.js"))],
                              capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def test_axe_finds_nothing_serious(self):
        work = judges(self, "AXE-CORE HAS NOT SEEN THE PAGES")
        with open(os.path.join(work, "node_modules/axe-core/axe.min.js"), encoding="utf-8") as file:
            axe = file.read()
        for page, address in PAGES.items():
            for width, is_dark in ((1280, False), (390, True)):
                self.look(width, 900, is_dark)
                self.visit(address)
                self.wait_for_state("streaming")
                if page == "live":
                    self.browser.find_element(By.ID, "above").send_keys(Keys.ARROW_RIGHT, Keys.ENTER)
                    self.wait_for(lambda: "range_m" in self.why(), "it does not say why")
                time.sleep(2)
                self.run_js(axe)
                found = self.browser.execute_async_script("axe.run().then(arguments[0])")["violations"]
                serious = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
                self.assertEqual(serious, [], (page, width, is_dark))


class Looks(Browsed):
    """Every page from a telephone to a wall, dark and light: nothing hangs over. The screenshots are for people."""

    SIZES = ((360, 740), (390, 844), (1600, 1000), (3840, 2160))

    def test_fits_every_window(self):
        for page, address in PAGES.items():
            for width, height in self.SIZES:
                for is_dark in (False, True):
                    self.look(width, height, is_dark)
                    self.visit(address)
                    self.wait_for_state("streaming")
                    time.sleep(2)
                    self.assertLessEqual(self.run_js("return document.documentElement.scrollWidth"), width, (page, width))
                    self.keep_screenshot(f"{page}_{width}_{'dark' if is_dark else 'light'}")
        self.assertEqual(self.errors(), [])


class Console60(Browsed):
    """640x480 at 60 frames a second, made in advance, in front of a console on the same machine: it draws 15 a second or more, the CSV
    beside it lacks nothing, and its heap is flat. SECONDS of the environment: for how long, 60 unless it is set."""

    def test_keeps_up_and_stays_small(self):
        seconds = int(os.environ.get("SECONDS", "60"))
        self.end()
        text = small_scene().replace("width: 160, height: 120", "width: 640, height: 480")
        self.scene = self.write("wide.yaml", re.sub(r"picture_rate_hz: [\d.]+", "picture_rate_hz: 60", text))
        striper("simulate", self.scene, "-o", self.path("wide"), "--frames", "1")
        self.model = self.path("wide", "model.yaml")
        with VirtualCamera(self.scene, "--loop", "60") as camera:
            self.start(source=camera.uri("fps=60"))
            self.visit()
            self.wait_for_state("streaming")
            time.sleep(10)
            before, heap, begin = self.counted(), self.heap(), time.monotonic()
            heaps = []
            while time.monotonic() - begin < seconds:
                time.sleep(min(10, seconds / 6))
                heaps.append(self.heap())
            took = time.monotonic() - begin
            after = self.counted()
        log = self.end()
        found = {"drawn_hz": round((after["drawn"] - before["drawn"]) / took, 1), "scans_hz": round((after["scans"] - before["scans"]) / took, 1),
                 "heap_mb": [round(one / 1e6, 2) for one in (heap, *heaps)], "seconds": round(took)}
        print(found)
        self.assertGreaterEqual(found["drawn_hz"], 15)
        self.assertLess(min(heaps[-2:]) - heap, 1.5e6)
        self.assertRegex(log, r"csv:\S+ finished, \d+ written, 0 lost")

    def counted(self):
        return {name: int(self.data(name)) for name in ("drawn", "scans")}

    def heap(self):
        self.browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        return self.run_js("return performance.memory.usedJSHeapSize")


del Browsed  # Or it is run here, too.

if __name__ == "__main__":
    unittest.main()
