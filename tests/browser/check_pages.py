"""Reports in a real browser (``make page-check``): needs selenium, Chromium and its driver, and is no test."""

from __future__ import annotations

import re
import shutil
import sys
import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

MOST_BYTES, MOST_SECONDS = 2_500_000, 2.0
READING = "return document.getElementById('readings-0').rows[0].cells[2].textContent"
DRAWN = "return document.documentElement.dataset.drawn === 'all'"
MOVED = """
const slider = document.getElementById('ratio-0');
slider.value = arguments[0];
slider.dispatchEvent(new Event('input'));
return document.getElementById('ratio-told-0').textContent;
"""


def browser(width: int) -> webdriver.Chrome:
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless=new", "--no-sandbox", f"--window-size={width},1000"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))


def check(page: Path, width: int) -> list[str]:
    """What is wrong with a page at a width of the window [px]."""
    faults = [f"{page.stat().st_size} bytes"] if page.stat().st_size > MOST_BYTES else []
    driver = browser(width)
    try:
        driver.get(page.resolve().as_uri())
        start = time.monotonic()
        while not driver.execute_script(DRAWN) and time.monotonic() - start < 60.0:
            time.sleep(0.05)
        if time.monotonic() - start > MOST_SECONDS:
            faults.append(f"drawn in {time.monotonic() - start:.1f} s")
        if driver.execute_script("return document.documentElement.scrollWidth > innerWidth"):
            faults.append(f"wider than {width} px")
        if driver.execute_script("return !!document.getElementById('ratio-0')"):
            judged, own = driver.execute_script(READING), driver.execute_script(MOVED, 0)
            if "estimate" not in own or driver.execute_script(READING) == judged:
                faults.append("the slider of the ratio changes nothing")
            driver.execute_script("document.querySelector('[data-reset]').click()")
            if driver.execute_script(READING) != judged:
                faults.append("the ratio as judged does not give the numbers as judged")
        faults += [f"console: {one['message'][:200]}" for one in driver.get_log("browser") if one["level"] == "SEVERE"]
        sent = [re.search(r'"url":"(https?:[^"]*)"', one["message"]) for one in driver.get_log("performance")]
        faults += [f"asks for {one[1]}" for one in sent if one]
    finally:
        driver.quit()
    return faults


if __name__ == "__main__":
    wrong = 0
    for path in map(Path, sys.argv[1:]):
        for wide in (1400, 400):
            found = check(path, wide)
            wrong += len(found)
            print(f"{path} at {wide} px: {'; '.join(found) or 'as it should be'}")
    sys.exit(bool(wrong))
