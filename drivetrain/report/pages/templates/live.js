// The controls of a page that answers: one question at a time, always the last one asked.
"use strict";
(function () {
  const root = document.getElementById("live"), told = document.getElementById("live-told");
  const inputs = (chosen, from = root) => Array.from(from.querySelectorAll(chosen));
  const touched = new Set(); // joints whose ratio is not their gear's own
  const short = (value) => String(Number(Number(value).toPrecision(6)));
  let asking = false, next = null;

  function asked() {
    const found = { values: {}, drives: {}, ratios: {} };
    const value = (box) => (box.value === "" ? box.value : Number(box.value));
    for (const box of inputs("input[type=number][data-control]")) found.values[box.dataset.control] = value(box);
    for (const joint of inputs("[data-joint]")) {
      found.drives[joint.dataset.joint] = inputs("[data-part]", joint).map((box) => box.value.trim());
      if (touched.has(joint.dataset.joint)) found.ratios[joint.dataset.joint] = value(joint.querySelector("input[type=number][data-ratio]"));
    }
    return found;
  }

  async function ask(path) {
    if (asking) return void (next = path);
    asking = true;
    told.textContent = path === "select" ? "searching ..." : "judging ...";
    root.dataset.state = "asking";
    try {
      const start = performance.now();
      const reply = await fetch("/" + path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked()) });
      const found = await reply.json();
      told.className = found.faults ? "fail" : "";
      if (found.faults) told.textContent = found.faults.join("\n");
      else {
        told.textContent = `${found.told}\nanswered in ${Math.round(performance.now() - start)} ms`;
        if (next === null) {
          put(found.drives);
          await page.renew(found.content, found.data);
        }
      }
    } catch (error) {
      told.className = "fail";
      told.textContent = `no answer: ${error.message}; is drivetrain serve still running?`;
    }
    asking = false;
    root.dataset.state = "answered";
    if (next !== null) {
      const path = next;
      next = null;
      ask(path);
    }
  }

  function put(drives) {
    for (const joint of inputs("[data-joint]")) {
      const [motor, gear, ratio] = drives[joint.dataset.joint] || ["", "", 0], parts = inputs("[data-part]", joint);
      if (document.activeElement !== parts[0]) parts[0].value = motor;
      if (document.activeElement !== parts[1]) parts[1].value = gear;
      for (const box of inputs("[data-ratio]", joint)) {
        box.disabled = !ratio;
        if (box.type === "range" && !touched.has(joint.dataset.joint)) Object.assign(box, { min: 0.4 * ratio, max: 2.5 * ratio });
        if (document.activeElement !== box) box.value = short(ratio);
      }
    }
  }

  root.addEventListener("input", (event) => {
    const box = event.target, joint = box.closest("[data-joint]");
    if (box.dataset.part !== undefined) return; // a key is asked for when it is whole
    if (joint) touched.add(joint.dataset.joint);
    for (const twin of joint ? inputs("[data-ratio]", joint) : inputs("[data-control]").filter((one) => one.dataset.control === box.dataset.control))
      if (twin !== box) twin.value = short(box.value);
    ask("evaluate");
  });
  root.addEventListener("change", (event) => {
    if (event.target.dataset.part === undefined) return;
    touched.delete(event.target.closest("[data-joint]").dataset.joint);
    ask("evaluate");
  });
  if (innerWidth < 960) root.querySelector("details").open = false; // the report first, where there is no room for both
  root.querySelector("form").addEventListener("submit", (event) => event.preventDefault());
  document.getElementById("live-select").addEventListener("click", () => { touched.clear(); ask("select"); });
  document.getElementById("live-reset").addEventListener("click", () => { root.querySelector("form").reset(); touched.clear(); ask("evaluate"); });
})();
