"""Reports, and a page that answers, in a real browser (``make page-check``): needs Chromium and its driver.

Times are processor seconds of the page's main thread until all that is first seen is drawn, and what the page's own
clock says then, which other work on the machine lengthens.
"""

from __future__ import annotations

import re
import shutil
import sys
import threading
import time
from pathlib import Path

from axe_selenium_python import Axe
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

import drivetrain as dt
from drivetrain.commands.server import server_of
from drivetrain.report.pages.live_page import LivePage

MOST_BYTES, MOST_SECONDS = 2_500_000, 2.0
A4 = 688  # px: 210 mm without margins of 14 mm
READING = "return document.getElementById('readings-0').rows[0].cells[2].textContent"
DRAWN = "return ['view', 'all'].includes(document.documentElement.dataset.drawn)"
HAS_PICTURES = "return !!document.getElementById('data')"
MOVED = """
const slider = document.getElementById(arguments[0]);
slider.value = arguments[1];
slider.dispatchEvent(new Event('input'));
return document.getElementById('ratio-told-0').textContent;
"""
ALL = "return document.documentElement.dataset.drawn === 'all'"
FIRST = "return performance.getEntriesByName('view')[0].startTime"
INKS = """
return Array.from(document.querySelectorAll('.chart, .strip')).filter((one) => one.view)
  .map((one) => one.view.model.left[0].axis_label_text_color);
"""
LIVE = """
const boxes = Array.from(document.querySelectorAll('#live input[type=range]'));
const box = boxes.find((one) => one.dataset.control === arguments[0]);
box.value = arguments[1];
box.dispatchEvent(new Event('input', {bubbles: true}));
"""
ANSWERED = "return document.getElementById('live').dataset.state === 'answered'"
TOLD = "return document.getElementById('live-told').textContent"


def browser(width: int) -> webdriver.Chrome:
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless=new", "--no-sandbox", f"--window-size={width},1000"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))


def until(driver: webdriver.Chrome, script: str) -> None:
    start = time.monotonic()
    while not driver.execute_script(script) and time.monotonic() - start < 60.0:
        time.sleep(0.05)


def faults_of(driver: webdriver.Chrome, own: str = "") -> list[str]:
    """Errors on the console, requests that leave the page, and what a reader without eyes or mouse stumbles over."""
    told = [one for one in driver.get_log("browser") if one["level"] in ("SEVERE", "WARNING")]
    faults = sorted({f"console: {one['message'][:200]}" for one in told})
    sent = [re.search(r'"url":"(https?:[^"]*)"', one["message"]) for one in driver.get_log("performance")]
    faults += sorted({f"asks for {one[1]}" for one in sent if one and not (own and one[1].startswith(own))})
    driver.set_script_timeout(300)
    axe = Axe(driver)
    axe.inject()
    for one in axe.run()["violations"]:
        if one["impact"] in ("serious", "critical"):
            nodes = "; ".join(node["html"][:90] for node in one["nodes"][:3])
            faults.append(f"{one['impact']}: {one['id']}, {len(one['nodes'])} times: {nodes}")
    return faults


def check(page: Path, width: int) -> list[str]:
    """What is wrong with a page at a width of the window [px]."""
    faults = [f"{page.stat().st_size} bytes"] if page.stat().st_size > MOST_BYTES else []
    driver = browser(width)
    try:
        driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
        driver.get(page.resolve().as_uri())
        if driver.execute_script(HAS_PICTURES):
            until(driver, DRAWN)
        found = driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
        seconds = next(one["value"] for one in found if one["name"] == "TaskDuration")
        first = driver.execute_script(FIRST) / 1e3 if driver.execute_script(HAS_PICTURES) else 0.0
        size = f"{page.stat().st_size / 1e6:.2f} MB"
        print(f"{page}, {width} px: {seconds:.2f} s of processor time, {first:.2f} s by its clock, {size}")
        if seconds > MOST_SECONDS:
            faults.append(f"drawn in {seconds:.1f} s")
        if driver.execute_script("return document.documentElement.scrollWidth > innerWidth"):
            faults.append(f"wider than {width} px")
        if driver.execute_script("return !!document.getElementById('ratio-0')"):
            judged = driver.execute_script(READING)
            for box, value in (("ratio-0", 0), ("ratio-box-0", 1)):
                own = driver.execute_script(MOVED, box, value)
                if "estimate" not in own or driver.execute_script(READING) == judged:
                    faults.append(f"{box} changes nothing")
                driver.execute_script("document.querySelector('[data-reset]').click()")
                if driver.execute_script(READING) != judged:
                    faults.append("the ratio as judged does not give the numbers as judged")
        faults += switched(driver)
        faults += faults_of(driver)
        faults += on_paper(driver)
    finally:
        driver.quit()
    return faults


def on_paper(driver: webdriver.Chrome) -> list[str]:
    """What is cut off on the narrower of A4 and Letter, with all that is folded unfolded."""
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    screen = {"width": A4, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    driver.execute_script("for (const one of document.querySelectorAll('details')) one.open = true;")
    wide = driver.execute_script("return document.documentElement.scrollWidth")
    return [f"{wide} px wide on paper of {A4}"] if wide > A4 else []


def switched(driver: webdriver.Chrome) -> list[str]:
    """What stays as it was when the reader's system goes dark while the page is open."""
    until(driver, ALL)
    before = driver.execute_script(INKS)
    driver.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    )
    time.sleep(1.0)  # until it has heard of it
    until(driver, ALL)
    left = sum(old == new for old, new in zip(before, driver.execute_script(INKS), strict=True))
    return [f"{left} of {len(before)} pictures keep their inks on a dark page"] if left else []


def check_live(study: Path, width: int) -> list[str]:
    """What is wrong with the page that answers."""
    loaded = dt.load_study(study)
    live = LivePage(loaded, dt.select(loaded))
    server = server_of(live)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address, driver, faults = f"http://127.0.0.1:{server.server_address[1]}/", browser(width), list[str]()
    drives = {name: list(pair) for name, pair in live.first.drives.items()}
    try:
        driver.get(address)
        until(driver, DRAWN)
        for name, value in (("voltage", 0.8 * loaded.supply.voltage), ("cycle time", 0.9 * loaded.cycle.duration)):
            driver.execute_script(LIVE, name, value)
            until(driver, ANSWERED)
            values = {name: float(f"{value:.6g}")}
            expected = live.answer({"values": values, "drives": drives})["told"]
            told = driver.execute_script(TOLD)
            print(f"{name} {value:.4g}: {told!r}")
            if expected not in told:
                faults.append(f"{name}: says {told!r} where evaluate says {expected!r}")
            driver.execute_script("document.getElementById('live-reset').click()")
            until(driver, ANSWERED)
        faults += faults_of(driver, own=address)
    finally:
        driver.quit()
        server.shutdown()
    return faults


if __name__ == "__main__":
    wrong = 0
    for path in map(Path, sys.argv[1:]):
        for wide in (1400, 400):
            found = (check_live if path.suffix == ".yaml" else check)(path, wide)
            wrong += len(found)
            print(f"{path} at {wide} px: {'; '.join(found) or 'as it should be'}")
    sys.exit(bool(wrong))
