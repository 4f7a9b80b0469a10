// The moving pictures of a report: planes with ratios, strips and the arm on one clock, the rejected candidates.
"use strict";
page.setup(function () {
  const motion = page.data.motion, byId = (id) => document.getElementById(id);
  const COLOURS = ["#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9", "#7f6a3f", "#888888"];
  const percent = (share) => {
    if (!Number.isFinite(share)) return "–";
    if (share > 1e4) return share < 1e6 ? "> 10⁶ %" : "∞"; // unlimited ones come as 1e6
    return (100 * share).toFixed(share > 0.99 && share < 1.01 ? 1 : 0) + " %";
  };
  const short = (value) => (Number.isFinite(value) ? Number(value.toPrecision(3)).toString() : "–");
  if (motion && motion.joints) moving();
  if (page.data.rejected) rejected();

  function moving() {
    const time = page.numbers(motion.time), n = time.length, units = motion.units;
    const now = byId("time"), chosen = byId("strip-joint"), supply = byId("supply-share"), warm = byId("winding-at");
    let sample = 0;
    const joints = motion.joints.map((joint, k) => {
      const series = {};
      for (const name in joint.series) series[name] = page.numbers(joint.series[name]);
      const own = { ...joint, k, series, g: joint.ratio.own, range: byId("ratio-" + k), box: byId("ratio-box-" + k), live: { ...series }, spin: page.numbers(joint.ratio.spin), redraws: {} };
      return Object.defineProperty(own, "c", { get: () => page.colour(COLOURS[k % COLOURS.length]) }); // light or dark
    });

    // What a ratio does to one joint; at the ratio judged it gives back the engine's numbers.
    function recompute(joint) {
      const r = joint.ratio, own = joint.series, g = joint.g, s = r.own / g;
      const torque = new Float64Array(n), speed = new Float64Array(n), current = new Float64Array(n), voltage = new Float64Array(n), power = new Float64Array(n);
      const at = warm ? warm.value : "hot", hot = joint.resistances.hot, resistance = joint.resistances[at] ?? hot;
      const most = { peak: 0, peak0: 0, voltage: 0, voltage0: 0 };
      for (let i = 0; i < n; i++) {
        const rotor = r.rotor * own.rotor[i];
        torque[i] = (own.torque[i] - rotor) * s + rotor + joint.spin[i] * (1 / s - 1);
        speed[i] = own.speed[i] * s ** -1;
        current[i] = own.current[i] + (torque[i] - own.torque[i]) / r.constant;
        voltage[i] = own.voltage[i] + r.back_emf * (speed[i] - own.speed[i]) + hot * (current[i] - own.current[i]) + (resistance - hot) * current[i];
        most.peak = Math.max(most.peak, Math.abs(torque[i])); most.peak0 = Math.max(most.peak0, Math.abs(own.torque[i]));
        most.voltage = Math.max(most.voltage, Math.abs(voltage[i])); most.voltage0 = Math.max(most.voltage0, Math.abs(own.voltage[i]));
      }
      const w = [s, 1, 1 / s - 1], square = (v) => v.reduce((sum, a, i) => sum + v.reduce((row, b, j) => row + a * b * r.moments[3 * i + j], 0), 0);
      const share = Number(supply ? supply.value : 1);
      joint.scale = {
        peak: most.peak / most.peak0, rms: Math.sqrt(square(w) / square([1, 1, 0])), speed: 1 / s,
        voltage: most.voltage / most.voltage0 / share,
      };
      Object.assign(joint.live, { torque, speed, current, voltage });
      joint.region = joint.regions[at + " " + share] || joint.regions["hot " + share];
      joint.edges = edges(joint.region[0]);
      const used = Float64Array.from(time, (_, i) => 100 * gauge(joint.edges, speed[i], torque[i]));
      joint.live.used = used;
      joint.live.outside = Float64Array.from(used, (u, i) => (u > 100 + 1e-6 ? torque[i] : NaN));
      joint.judged = Math.abs(g - r.own) < 1e-9 * r.own && share === 1 && at === "hot";
    }
    // Half planes a x + b y <= 1 of a convex polygon round the origin; the largest a x + b y is what is used of it.
    function edges([xs, ys]) {
      const found = [];
      for (let i = 0; i + 1 < xs.length; i++) {
        const bound = xs[i] * ys[i + 1] - xs[i + 1] * ys[i];
        if (Math.abs(bound) > 1e-12) found.push([(ys[i + 1] - ys[i]) / bound, (xs[i] - xs[i + 1]) / bound]);
      }
      return found;
    }
    const gauge = (lines, x, y) => lines.reduce((most, [a, b]) => Math.max(most, a * x + b * y), 0);

    function readings(joint) {
      const body = byId("readings-" + joint.k);
      if (!body) return;
      const note = byId("ratio-told-" + joint.k);
      if (note) note.textContent = `ratio ${short(joint.g)}` + (joint.judged ? ", as evaluated" : ": an estimate");
      for (const row of body.rows) {
        const share = joint.checks[row.dataset.check] * joint.scale[row.dataset.follows], cell = row.cells[2];
        cell.textContent = percent(joint.judged ? joint.checks[row.dataset.check] : share);
        cell.className = "n " + (share > 1 ? "fail" : "");
      }
    }
    const visible = (joint) => ({ t: time, speed: joint.live.speed, torque: joint.live.torque, used: joint.live.used, outside: joint.live.outside });

    for (const joint of joints) {
      recompute(joint);
      readings(joint);
      const element = byId("plane-" + joint.k);
      page.later(element, () => plane(joint, element));
      for (const one of [joint.range, joint.box]) if (one) one.addEventListener("input", () => { if (Number(one.value) > 0) turned(joint, Number(one.value), one); });
    }
    for (const one of [supply, warm]) if (one) one.addEventListener("change", () => joints.forEach(changed));
    document.querySelectorAll("[data-reset]").forEach((one) => one.addEventListener("click", () => {
      const joint = joints[Number(one.dataset.reset)];
      turned(joint, joint.ratio.own);
    }));

    function turned(joint, ratio, by) {
      joint.g = ratio;
      if (by !== joint.range) joint.range.value = ratio;
      if (by !== joint.box) joint.box.value = Number(ratio.toPrecision(4));
      changed(joint);
    }

    function changed(joint) {
      recompute(joint);
      readings(joint);
      for (const redraw of Object.values(joint.redraws)) redraw();
      for (const strip of strips) strip.redraw(joint);
      instant();
    }

    function plane(joint, element) {
      const [wide, high] = joint.view, of = units.torque;
      const figure = page.frame({ height: 330, x: `motor speed [${units.speed}]`, y: `motor torque [${of}]`, x_range: [-wide, wide], y_range: [-high, high] });
      figure.below[0].ticker.desired_num_ticks = 4; // thousands of rpm run into each other in a third of the page
      const legend = [], dashed = { line_dash: [4, 3], fill_color: null };
      const region = (i) => { const one = joint.region[i]; return one ? { x: one[0], y: one[1] } : { x: [], y: [] }; };
      const areas = [["#0072B2", 0.13, "intermittent limit"], ["#009E73", 0.22, "continuous limit"]].map(([ink, alpha, label], i) => {
        const source = new Bokeh.ColumnDataSource({ data: region(i) });
        const drawn = figure.patch({ field: "x" }, { field: "y" }, { source, fill_color: ink, fill_alpha: alpha, line_color: ink });
        if (joint.region[i]) legend.push([label, "box", ink, 0.4, drawn]);
        return source;
      });
      for (const dimension of ["width", "height"]) figure.add_layout(new Bokeh.Span({ dimension, location: 0, line_color: page.colour("muted"), line_width: 0.7 }));
      const source = new Bokeh.ColumnDataSource({ data: visible(joint) });
      figure.line({ field: "speed" }, { field: "torque" }, { source, line_color: page.colour("muted"), line_width: 0.7 });
      const mapper = new Bokeh.LinearColorMapper({ palette: page.data.instants.slice(page.dark.matches ? 6 : 0), low: time[0], high: time[n - 1] });
      const dots = figure.scatter({ field: "speed" }, { field: "torque" }, { source, size: 5, line_color: null, fill_color: { field: "t", transform: mapper } });
      legend.push(["the motion, dark to light in time", "dot", "#23898e", 1, dots]);
      const out = figure.scatter({ field: "speed" }, { field: "outside" }, { source, size: 8, marker: "x", line_color: "#D55E00", line_width: 2 });
      legend.push(["outside the intermittent limit", "cross", "#D55E00", 1, out]);
      const mark = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
      figure.scatter({ field: "x" }, { field: "y" }, { source: mark, size: 14, marker: "circle_dot", line_color: page.colour("ink"), fill_color: null, line_width: 2 });
      figure.add_tools(new Bokeh.HoverTool({ renderers: [dots], mode: "mouse", limit: 1, tooltips: [
        ["instant", "@t{0.000} s"], ["torque", `@torque{0.0000} ${of}`], ["speed", `@speed{0} ${units.speed}`], ["used of the intermittent limit", "@used{0} %"]] }));
      joint.redraws.plane = () => {
        source.data = visible(joint);
        areas.forEach((area, i) => (area.data = region(i)));
        const fast = 1.1 * Math.max(...joint.live.speed.map(Math.abs)), strong = 1.1 * Math.max(...joint.live.torque.map(Math.abs));
        figure.x_range.setv({ start: -Math.max(wide, fast), end: Math.max(wide, fast) });
        figure.y_range.setv({ start: -Math.max(high, strong), end: Math.max(high, strong) });
      };
      joint.mark = () => (mark.data = { x: [joint.live.speed[sample]], y: [joint.live.torque[sample]] });
      joint.mark();
      return page.show(figure, element, legend);
    }

    // The gear: what its output carries at which input speed.
    for (const joint of joints) {
      const element = byId("gear-" + joint.k);
      if (element) page.later(element, () => gear(joint, element));
    }
    const FAR = 4; // times what the cycle needs: a limit beyond stands below the picture alone
    function gear(joint, element) {
      const most = (values) => Math.max(...values.map(Math.abs)), legend = [];
      const near = (torque, reach) => joint.gear_limits.filter(([, value, of]) => of === torque && value <= FAR * reach).map((one) => one[1]);
      const least = Math.min(...joint.gear_limits.filter(([, , of]) => !of).map((one) => one[1])) / FAR; // of a joint that never moves
      const speed = most(joint.series.speed) || (Number.isFinite(least) ? least : 1), torque = most(joint.series.gear);
      const figure = page.frame({ height: 330, x: `gear input speed, magnitude [${units.speed}]`, y: `torque at the output, magnitude [${units.gear}]`,
        x_range: [0, 1.12 * Math.max(speed, ...near(false, speed))], y_range: [0, 1.12 * Math.max(torque, ...near(true, torque))] });
      const data = () => ({ x: joint.live.speed.map(Math.abs), y: joint.series.gear.map(Math.abs), t: time });
      const source = new Bokeh.ColumnDataSource({ data: data() });
      const mapper = new Bokeh.LinearColorMapper({ palette: page.data.instants.slice(page.dark.matches ? 6 : 0), low: time[0], high: time[n - 1] });
      const dots = figure.scatter({ field: "x" }, { field: "y" }, { source, size: 5, line_color: null, fill_color: { field: "t", transform: mapper } });
      figure.add_tools(new Bokeh.HoverTool({ renderers: [dots], limit: 1, tooltips: [["instant", "@t{0.000} s"], ["torque", `@y{0.00} ${units.gear}`], ["input speed", `@x{0} ${units.speed}`]] }));
      const inks = { rated: "#888888", average: "#0072B2", mean: "#0072B2", repeated: "#E69F00", momentary: "#D55E00", maximum: "#D55E00" };
      for (const [name, value, of] of joint.gear_limits) {
        const ink = inks[name.split(" ")[0]], unit = of ? units.gear : units.speed;
        if (value > FAR * (of ? torque : speed)) continue;
        figure.add_layout(new Bokeh.Span({ dimension: of ? "width" : "height", location: value, line_color: ink, line_dash: of ? [] : [5, 3], line_width: 1.3 }));
        legend.push([`${name} ${short(value)} ${unit}`, of ? "line" : "dashed", ink, 1, { visible: true }]);
      }
      joint.redraws.gear = () => (source.data = data());
      return page.show(figure, element, legend);
    }

    // Strips over time: all joints, or one joint with all that is known of it.
    let strips = [];
    const QUANTITIES = [["position", "position"], ["speed", "motor speed"], ["torque", "motor torque"], ["current", "current"], ["voltage", "terminal voltage"], ["gear", "torque at the gear's output"], ["power", "electrical power"], ["winding", "winding temperature"]];
    const PARTS = [["load", "load through the gear", "#56B4E9"], ["rotor", "own rotor", "#CC79A7"], ["friction", "friction and mesh loss", "#E69F00"]];
    async function drawStrips() {
      const place = byId("strips"), one = chosen.value === "" ? null : joints[Number(chosen.value)];
      delete page.ranges.clock;
      strips = [];
      place.replaceChildren();
      const lines = one ? [one] : joints;
      const shown = (one ? QUANTITIES : QUANTITIES.slice(1, 5)).filter(([key]) => lines.some((joint) => joint.series[key]));
      const last = shown[shown.length - 1][0];
      for (const [key, title] of shown) {
        const element = document.createElement("div"), legend = [];
        const unit = key === "position" ? (one.slides ? "m" : units.position) : units[key];
        const figure = page.frame({ height: (one ? 165 : 185) + (key === last ? 18 : 0), x: key === last ? motion.clock : "", y: `${title} [${unit}]`, joined: "clock", x_range: [time[0], time[n - 1]] });
        figure.toolbar_location = null;
        figure.min_border_left = 72;
        motion.segments.forEach(([ends], i) => { if (i % 2) figure.add_layout(new Bokeh.BoxAnnotation({ left: ends[0], right: ends[1], fill_color: page.colour("faint"), fill_alpha: 0.4, line_color: null, level: "underlay" })); });
        const drawn = [];
        for (const joint of lines) {
          if (!joint.series[key]) continue;
          const named = key === "torque" && one ? [...PARTS, ["torque", "motor torque", page.colour("ink")]] : key === "winding" && one && one.series.housing ? [["winding", "winding", "#D55E00"], ["housing", "housing", "#64748b"]] : [[key, one ? "" : joint.name, joint.c]];
          for (const [name, label, ink] of named) {
            const source = new Bokeh.ColumnDataSource({ data: track(joint, name) });
            const line = figure.line({ field: "x" }, { field: "y" }, { source, line_color: ink, line_width: 1.5 });
            drawn.push([joint, name, source]);
            if (label) legend.push([label, "line", ink, 1, line]);
          }
        }
        const most = Math.max(...lines.map((joint) => Math.max(...(joint.series[key] || [0]).map(Math.abs))));
        for (const [label, value] of one ? (one.limits[key] || []) : []) {
          if (value > 3 * most) { legend.push([`${label}: ${short(value)} ${unit}, beyond the picture`, "none", "#D55E00", 1, { visible: true }]); continue; }
          for (const sign of key === "winding" ? [1] : [1, -1]) figure.add_layout(new Bokeh.Span({ dimension: "width", location: sign * value, line_color: "#D55E00", line_dash: [5, 3] }));
          legend.push([`${label}: ${short(value)} ${unit}`, "dashed", "#D55E00", 1, { visible: true }]);
          if (value > most) figure.y_range = new Bokeh.Range1d(key === "winding" ? { start: Math.min(...one.series.winding) - 5, end: 1.05 * value } : { start: -1.1 * value, end: 1.1 * value });
        }
        const cursor = new Bokeh.Span({ dimension: "height", location: time[sample], line_color: page.colour("muted"), line_width: 1.5 });
        figure.add_layout(cursor);
        for (const event of ["mousemove", "tap"]) figure.js_event_callbacks[event] = [{ execute: (cb) => at(cb.x) }];
        strips.push({ cursor, redraw: (joint) => { for (const [whose, name, source] of drawn) if (whose === joint && joint.live[name] !== joint.series[name]) source.data = track(joint, name); } });
        place.append(element);
        element.className = "strip";
        await page.show(figure, element, one || strips.length === 1 ? legend : []);
      }
    }
    // A line, cut where one part of a mix ends and the next begins.
    function track(joint, name) {
      const live = joint.live, y = name === "load" ? Float64Array.from(time, (_, i) => live.torque[i] - live.rotor[i] - live.friction[i]) : live[name];
      const x = Array.from(time), values = Array.from(y);
      for (const i of [...motion.breaks].reverse()) { x.splice(i, 0, x[i]); values.splice(i, 0, NaN); }
      return { x, y: values };
    }
    page.later(byId("strips"), drawStrips);
    chosen.addEventListener("change", drawStrips);

    // The clock.
    function at(value) {
      let low = 0, high = n - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (time[middle] > value) high = middle; else low = middle; }
      sample = Math.abs(time[high] - value) < Math.abs(time[low] - value) ? high : low;
      const used = (k) => Math.max(...joints.map((joint) => joint.live.used[k]));
      if (sample && time[sample - 1] === time[sample] && used(sample - 1) > used(sample)) sample -= 1;  // of a step the harder side
      now.value = time[sample];
      byId("time-told").textContent = `${time[sample].toFixed(3)} s`;
      const segment = motion.segments.find(([ends]) => time[sample] <= ends[1]);
      byId("segment-told").textContent = segment ? segment[1] : "";
      for (const strip of strips) strip.cursor.location = time[sample];
      for (const joint of joints) if (joint.mark) joint.mark();
      instant();
      if (pose) pose();
    }
    function instant() {
      const body = byId("instant");
      joints.forEach((joint, k) => {
        const cells = body.rows[k].cells, live = joint.live;
        cells[0].firstChild.style.background = joint.c;
        [live.speed, live.torque, live.current, live.voltage].forEach((values, i) => (cells[i + 1].textContent = short(values[sample])));
        cells[5].textContent = percent(live.used[sample] / 100);
      });
    }
    now.addEventListener("input", () => at(Number(now.value)));
    let playing = null;
    byId("play").addEventListener("click", (event) => {
      const start = performance.now(), from = sample >= n - 1 ? time[0] : time[sample];
      playing = playing ? null : { };
      const mine = playing, label = (text) => (event.target.textContent = text);
      label(mine ? "pause" : "play");
      const step = () => {
        if (playing !== mine || !mine) return;
        const value = from + (performance.now() - start) / 1000;
        at(Math.min(value, time[n - 1]));
        if (value < time[n - 1]) requestAnimationFrame(step);
        else { playing = null; label("play"); }
      };
      if (mine) requestAnimationFrame(step);
    });

    // The arm at the instant, seen from where the two angles say.
    let pose = null;
    const arm = motion.arm;
    if (arm) page.later(byId("arm"), drawArm);
    function drawArm(element) {
      const turn = byId("turn"), tilt = byId("tilt"), count = arm.samples.length, n = arm.points.length - 2;
      // Where link i (-1: the base) has brought a point, or with w = 0 a direction, at pose k.
      const moved = (k, i, v, w = 1) => {
        if (i < 0) return v;
        const m = arm.moved, at = 12 * (k * arm.links + i);
        return [0, 4, 8].map((r) => (m[at + r] * v[0] + m[at + r + 1] * v[1] + m[at + r + 2] * v[2]) / 1e4 + w * m[at + r + 3]);
      };
      const place = (k, i) => moved(k, Math.min(i - 1, n - 1), arm.points[i]);
      const chain = (k) => arm.points.map((_, i) => place(k, i));
      let reach = 1;
      for (let k = 0; k < count; k++) for (const v of chain(k).flat()) reach = Math.max(reach, 1.12 * Math.abs(v));
      const figure = page.frame({ height: 430, x: "", y: "", x_range: [-reach, reach], y_range: [-0.75 * reach, 1.15 * reach], equal: true });
      for (const axis of [figure.below[0], figure.left[0], ...figure.center]) axis.visible = false;
      figure.setv({ match_aspect: true, toolbar_location: null, min_border_left: 0, outline_line_color: null });
      figure.toolbar.tools = [];
      const of = (data) => new Bokeh.ColumnDataSource({ data });
      const sources = { floor: of({ xs: [], ys: [] }), shadow: of({ x: [], y: [] }), path: of({ x: [], y: [] }), ghosts: of({ xs: [], ys: [] }), axes: of({ xs: [], ys: [], c: [] }), links: of({ xs: [], ys: [], c: [] }), drives: of({ x: [], y: [], size: [], c: [], name: [], mass: [] }), tip: of({ x: [], y: [] }) };
      const X = { field: "x" }, Y = { field: "y" }, ink = page.colour("ink"), faint = page.colour("faint"), muted = page.colour("muted");
      figure.multi_line({ field: "xs" }, { field: "ys" }, { source: sources.floor, line_color: faint, line_width: 0.8 });
      figure.line(X, Y, { source: sources.shadow, line_color: faint, line_width: 7, line_cap: "round", line_join: "round" });
      figure.multi_line({ field: "xs" }, { field: "ys" }, { source: sources.ghosts, line_color: muted, line_alpha: 0.3, line_width: 2, line_join: "round" });
      figure.line(X, Y, { source: sources.path, line_color: "#56B4E9", line_width: 1.5 });
      figure.patches({ field: "xs" }, { field: "ys" }, { source: sources.links, fill_color: { field: "c" }, line_color: { field: "c" }, line_width: 0.5 });
      figure.multi_line({ field: "xs" }, { field: "ys" }, { source: sources.axes, line_color: { field: "c" }, line_width: 2.5 });
      const drives = figure.scatter(X, Y, { source: sources.drives, size: { field: "size" }, fill_color: { field: "c" }, line_color: "#fff" });
      figure.scatter(X, Y, { source: sources.tip, size: 9, marker: "diamond", fill_color: "#D55E00", line_color: null });
      figure.add_tools(new Bokeh.HoverTool({ renderers: [drives], tooltips: [["joint", "@name"], ["motor and gear", "@mass{0.00} kg"]] }));
      const heaviest = Math.max(...joints.map((joint) => joint.mass), 1e-9);
      let flat = null, depth = null;
      const put = (list) => ({ x: list.map((q) => q[0]), y: list.map((q) => q[1]) });
      const many = (lists) => ({ xs: lists.map((l) => l.map((q) => q[0])), ys: lists.map((l) => l.map((q) => q[1])) });
      // The outward triangles of all links that face the eye, the farthest first, shaded by how they face it.
      function bodies(k) {
        const seen = [];
        for (const { link, corners, faces } of arm.shapes) {
          const spots = corners.map((v) => { const w = moved(k, link, v); return [...flat(w), depth(w)]; });
          for (const face of faces) {
            const [a, b, c] = face.map((i) => spots[i]);
            const u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
            const facing = u[0] * v[1] - u[1] * v[0];
            if (facing <= 0) continue;
            const up = u[2] * v[0] - u[0] * v[2], share = (0.75 * facing + 0.5 * up) / Math.hypot(facing, up, u[1] * v[2] - u[2] * v[1]);
            seen.push([a[2] + b[2] + c[2], [a[0], b[0], c[0]], [a[1], b[1], c[1]], `hsl(213,14%,${Math.round(38 + 42 * Math.max(share, -0.2))}%)`]);
          }
        }
        seen.sort((a, b) => a[0] - b[0]);
        return { xs: seen.map((f) => f[1]), ys: seen.map((f) => f[2]), c: seen.map((f) => f[3]) };
      }
      function turned() {
        const a = (turn.value * Math.PI) / 180, e = (tilt.value * Math.PI) / 180;
        flat = ([x, y, z]) => [y * Math.cos(a) - x * Math.sin(a), z * Math.cos(e) - (x * Math.cos(a) + y * Math.sin(a)) * Math.sin(e)];
        depth = ([x, y, z]) => (x * Math.cos(a) + y * Math.sin(a)) * Math.cos(e) + z * Math.sin(e);
        const lines = [];
        for (let i = -4; i <= 4; i++) { const v = (i * reach) / 4; lines.push([[v, -reach, 0], [v, reach, 0]], [[-reach, v, 0], [reach, v, 0]]); }
        sources.floor.data = many(lines.map((l) => l.map(flat)));
        sources.path.data = put(Array.from({ length: count }, (_, k) => flat(place(k, n + 1))));
        sources.ghosts.data = many([0, 1, 2, 3].map((k) => chain(Math.floor((k * (count - 1)) / 4)).map(flat)));
        pose();
      }
      pose = () => {
        let k = 0;
        while (k + 1 < count && arm.samples[k + 1] <= sample) k++;
        const now = chain(k);
        sources.links.data = bodies(k);
        sources.shadow.data = put(now.map(([x, y]) => flat([x, y, 0])));
        sources.tip.data = put([flat(now[n + 1])]);
        const spots = arm.drives.map(({ link, point }) => moved(k, link, point));
        const ends = arm.drives.map(({ link, axis }, i) => { const d = moved(k, link, axis, 0); return [-1, 1].map((s) => flat(spots[i].map((v, j) => v + s * 0.11 * reach * d[j]))); });
        sources.axes.data = { ...many(ends), c: joints.map((joint) => joint.c) };
        sources.drives.data = { ...put(spots.map(flat)), size: joints.map((joint) => 8 + 18 * Math.cbrt(joint.mass / heaviest)), c: joints.map((joint) => joint.c), name: joints.map((joint) => joint.name), mass: joints.map((joint) => joint.mass) };
      };
      for (const one of [turn, tilt]) one.oninput = turned;
      let from = null;
      figure.js_event_callbacks.panstart = [{ execute: () => (from = [Number(turn.value), Number(tilt.value)]) }];
      figure.js_event_callbacks.pan = [{ execute: (cb) => {
        turn.value = ((from[0] - cb.delta_x / 2 + 900) % 360) - 180;
        tilt.value = Math.min(90, Math.max(0, from[1] + cb.delta_y / 2));
        turned();
      } }];
      turned();
      return page.show(figure, element);
    }
    at(Number(now.value));
  }

  // Rejected candidates: one list for the picture and the table, cut by joint and words, sorted by any column.
  function rejected() {
    const { columns, names, rows, chosen, axis, count } = page.data.rejected, body = byId("rejected-rows");
    const joint = byId("rejected-joint"), words = byId("rejected-words"), told = byId("rejected-told"), MOST = 200;
    const list = rows.map((row) => row.map((v, i) => (names[i] ? names[i][v] : v === null ? NaN : v)));
    const checks = names[columns.indexOf("check")], used = columns.indexOf("utilisation"), worth = columns.indexOf("objective"), check = columns.indexOf("check");
    let sorted = [used, 1], source = null;
    const stars = () => chosen.filter((one) => !joint.value || one[0] === joint.value);
    function wanted() {
      const asked = words.value.toLowerCase().split(/\s+/).filter(Boolean);
      return list.filter((row) => (!joint.value || row[0] === joint.value) && asked.every((word) => row.slice(0, check + 1).join(" ").toLowerCase().includes(word)));
    }
    function table() {
      const found = wanted(), [by, way] = sorted;
      found.sort((a, b) => way * (typeof a[by] === "number" ? a[by] - b[by] : a[by].localeCompare(b[by])));
      told.textContent = `${found.length} of ${count} rejected candidates` + (list.length < count ? ` (the closest ${list.length} are on this page)` : "") + (found.length > MOST ? `, the first ${MOST} listed` : "");
      body.replaceChildren(...found.slice(0, MOST).map((row) => {
        const line = document.createElement("tr");
        row.forEach((value, i) => {
          const cell = line.insertCell();
          cell.textContent = typeof value !== "number" ? value : i === used ? percent(value) : short(value);
          if (typeof value === "number") cell.className = "n";
        });
        return line;
      }));
      if (source) source.data = dots(found);
      if (source) source.stars.data = starred();
    }
    const inks = (name) => COLOURS[checks.indexOf(name) % COLOURS.length];
    const dots = (found) => ({ x: found.map((r) => r[worth]), y: found.map((r) => Math.min(100 * r[used], 2000)), c: found.map((r) => inks(r[check])), tip: found.map((r) => `${r[0]}: ${r[1]} with ${r[2]}\n${r[check]}: ${percent(r[used])} of the limit`) });
    const starred = () => ({ x: stars().map((r) => r[3]), y: stars().map((r) => 100 * r[4]), tip: stars().map((r) => `${r[0]}: ${r[1]} with ${r[2]}, ${r[5]}`) });
    page.later(byId("rejected-picture"), (element) => {
      const positive = list.every((r) => !(r[worth] <= 0)), figure = page.frame({ height: 360, x: axis, y: "highest utilisation [% of the limit]", log_x: positive, log_y: true });
      source = new Bokeh.ColumnDataSource({ data: dots(wanted()) });
      source.stars = new Bokeh.ColumnDataSource({ data: starred() });
      figure.add_layout(new Bokeh.Span({ dimension: "width", location: 100, line_color: "#D55E00" }));
      const X = { field: "x" }, Y = { field: "y" }, tooltips = "<div style='white-space:pre-line'>@tip</div>";
      const out = figure.scatter(X, Y, { source, size: 5, fill_color: { field: "c" }, line_color: null, fill_alpha: 0.7 });
      const own = figure.scatter(X, Y, { source: source.stars, size: 15, marker: "star", fill_color: page.colour("ink"), line_color: page.colour("ink") });
      figure.add_tools(new Bokeh.HoverTool({ renderers: [out, own], tooltips, limit: 3 }));
      const legend = checks.slice(0, COLOURS.length).map((name, i) => [name, "dot", COLOURS[i], 1, { visible: true }]);
      return page.show(figure, element, legend);
    });
    for (const one of [joint, words]) one.addEventListener("input", table);
    body.parentElement.querySelectorAll("thead button").forEach((button, i) => button.addEventListener("click", () => {
      sorted = [i, sorted[0] === i ? -sorted[1] : 1];
      body.parentElement.querySelectorAll("thead th").forEach((th, k) => (k === i ? th.setAttribute("aria-sort", sorted[1] > 0 ? "ascending" : "descending") : th.removeAttribute("aria-sort")));
      table();
    }));
    table();
  }
});
