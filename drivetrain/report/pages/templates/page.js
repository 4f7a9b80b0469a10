// Sorts the utilisation table by a click on a heading, filters it by verdict and joint. Works without: all rows show.
"use strict";
function tables() {
  const table = document.getElementById("checks");
  if (!table) return;
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const note = document.getElementById("checks-shown");
  const picked = { verdict: "", joint: "" };

  function keyOf(row, column) {
    const cell = row.cells[column];
    const value = cell.dataset.value;
    return value === undefined ? cell.textContent.trim().toLowerCase() : Number(value);
  }

  function compare(a, b) {
    if (typeof a === "number" && typeof b === "number") return a - b;
    return String(a).localeCompare(String(b), "en", { numeric: true });
  }

  function sortBy(heading, column) {
    const falling = heading.getAttribute("aria-sort") !== "descending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
    const order = rows.map((row, index) => ({ row, index, key: keyOf(row, column) }));
    order.sort((a, b) => (falling ? -1 : 1) * compare(a.key, b.key) || a.index - b.index);
    for (const { row } of order) body.appendChild(row);
  }

  function show() {
    let count = 0;
    for (const row of rows) {
      const hit =
        (!picked.verdict || row.dataset.verdict === picked.verdict) &&
        (!picked.joint || row.dataset.joint === picked.joint);
      row.hidden = !hit;
      if (hit) count += 1;
    }
    note.textContent = count + " of " + rows.length + " checks";
  }

  Array.from(table.tHead.rows[0].cells).forEach(function (heading, column) {
    const button = heading.querySelector("button");
    if (button) button.addEventListener("click", () => sortBy(heading, column));
  });

  for (const button of document.querySelectorAll("[data-filter]")) {
    button.addEventListener("click", function () {
      picked.verdict = button.dataset.filter;
      for (const other of document.querySelectorAll("[data-filter]")) {
        other.setAttribute("aria-pressed", String(other === button));
      }
      show();
    });
  }

  const chooser = document.getElementById("joint-filter");
  chooser.addEventListener("change", function () {
    picked.joint = chooser.value;
    show();
  });
  document.getElementById("check-tools").hidden = false;
  show();

  // Paper has no folds.
  window.addEventListener("beforeprint", function () {
    for (const part of document.querySelectorAll("details")) part.open = true;
  });

  // The navigation follows the reader.
  const links = new Map();
  for (const link of document.querySelectorAll("nav.side a")) links.set(link.hash.slice(1), link);
  if (!("IntersectionObserver" in window)) return;
  const watcher = new IntersectionObserver(
    function (entries) {
      for (const entry of entries) {
        if (!entry.isIntersecting || !links.has(entry.target.id)) continue;
        for (const link of links.values()) link.removeAttribute("aria-current");
        links.get(entry.target.id).setAttribute("aria-current", "true");
      }
    },
    { rootMargin: "-10% 0px -80% 0px" }
  );
  for (const section of document.querySelectorAll("section[id]")) watcher.observe(section);
}
tables();
