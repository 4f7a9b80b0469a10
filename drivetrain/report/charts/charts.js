// Draws the charts of a page by BokehJS (BSD-3-Clause), which the page carries. Each is drawn as it comes near the
// window, the rest when there is nothing else to do. Nothing is loaded from elsewhere.
"use strict";
const page = (function () {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const ranges = {};
  const drawings = []; // {element, draw, done}
  const setups = []; // what a script does with the data of the page, again when they are others
  let watcher = null;

  const BRIGHT = { "#0072B2": "#4C86F0", "#009E73": "#2CC79B", "#D55E00": "#FF8B45", "#7f6a3f": "#b59a62" }; // on dark
  const colour = (name) =>
    dark.matches && BRIGHT[name] ? BRIGHT[name] : ["ink", "muted", "faint", "paper"].includes(name)
      ? getComputedStyle(document.documentElement).getPropertyValue(name === "faint" ? "--line" : "--" + name).trim()
      : name;
  const DARK = "#1b2129";
  const ready = library();
  const numbers = (values) => Float64Array.from(values || [], (v) => (v === null ? NaN : v));

  async function library() {
    const packed = Uint8Array.from(atob(document.getElementById("library").textContent), (c) => c.charCodeAt(0));
    const flow = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const script = document.createElement("script");
    script.textContent = await new Response(flow).text();
    document.head.append(script);
    Bokeh.set_log_level("warn");
  }

  // An empty figure in the look of the page.
  function frame(spec) {
    const range = (ends) => (ends ? new Bokeh.Range1d({ start: ends[0], end: ends[1] }) : new Bokeh.DataRange1d());
    const rows = spec.rows && spec.rows.length;
    const figure = Bokeh.Plotting.figure({
      height: spec.height || 320, sizing_mode: "stretch_width", title: spec.title || null,
      tools: "pan,wheel_zoom,box_zoom,reset,save", toolbar_location: "above", active_drag: null,
      x_axis_type: spec.log_x ? "log" : "linear", y_axis_type: spec.log_y ? "log" : "linear",
      x_range: range(spec.x_range), y_range: range(rows ? [rows - 0.5, -0.5] : spec.y_range),
      background_fill_color: null, border_fill_color: null, outline_line_color: colour("faint"),
    });
    if (spec.joined) join(figure.x_range, (ranges[spec.joined] ||= []));
    figure.toolbar.autohide = true;
    figure.toolbar.logo = null;
    if (figure.title) Object.assign(figure.title, { text_color: colour("ink"), text_font_size: "12px" });
    for (const [axis, label] of [[figure.below[0], spec.x], [figure.left[0], spec.y]])
      axis.setv({
        axis_label: label || "", axis_label_text_color: colour("ink"), axis_label_text_font_style: "normal",
        axis_label_text_font_size: "12px", major_label_text_color: colour("ink"), axis_line_color: colour("muted"),
        major_tick_line_color: colour("muted"), minor_tick_line_color: null,
      });
    for (const grid of figure.center) grid.grid_line_color = colour("faint");
    if (!rows) figure.setv({ min_border_left: 72, min_border_right: 16 }); // room for half of the last label
    if (spec.log_x) decades(figure, figure.below[0], figure.x_range);
    if (spec.log_y) decades(figure, figure.left[0], figure.y_range);
    if (rows) {
      figure.below[0].ticker.desired_num_ticks = 5; // beside long names of rows there is room for few
      const ticker = new Bokeh.FixedTicker({ ticks: spec.rows.map((_, i) => i) });
      figure.left[0].ticker = ticker;
      figure.center.find((grid) => grid.dimension === 1).ticker = ticker;
      figure.left[0].major_label_overrides = new Map(spec.rows.map((name, i) => [i, name]));
    }
    return figure;
  }

  // Ticks of a logarithmic axis that do not run into each other: Bokeh's own are linear within two decades.
  function decades(figure, axis, range) {
    const ticker = new Bokeh.FixedTicker({ ticks: [] });
    const place = () => {
      const low = Math.log10(range.start), high = Math.log10(range.end), ticks = [];
      if (!(high > low)) return; // not known yet
      const many = innerWidth < 600 ? 2 : 4, step = 10 ** Math.floor(Math.log10((range.end - range.start) / 2));
      if (high - low < 0.5) for (let k = Math.ceil(range.start / step); k * step <= range.end; k++) ticks.push(k * step);
      else for (let k = Math.floor(low); k <= high; k++)
        ticks.push(...(high - low < 1 ? [1, 1.5, 2, 3, 5, 7] : high - low < many ? [1, 2, 5] : [1]).map((m) => m * 10 ** k));
      axis.major_label_overrides = new Map(ticks.map((tick) => [tick, String(Number(tick.toPrecision(4)))]));
      ticker.ticks = ticks;
    };
    axis.ticker = ticker;
    figure.center.find((grid) => grid.dimension === (axis === figure.below[0] ? 0 : 1)).ticker = ticker;
    for (const end of ["start", "end"]) range.properties[end].change.connect(place);
    place();
  }

  // Axes that show the same stretch: each picture is a document of its own, so the ranges tell each other.
  function join(own, others) {
    for (const end of ["start", "end"])
      own.properties[end].change.connect(() => {
        for (const other of others) if (other[end] !== own[end]) other[end] = own[end];
      });
    others.push(own);
  }

  function mark(figure, one, legend) {
    const ink = colour(one.colour || "#0072B2"), alpha = one.alpha === undefined ? 1 : one.alpha;
    const dash = one.dash ? [5, 3] : [], size = one.size === undefined ? 1.5 : one.size;
    const x = numbers(one.x), y = numbers(one.y), to = numbers(one.to), label = one.label || "";
    const line = { line_color: ink, line_width: size, line_dash: dash, line_alpha: alpha };
    let drawn = null;
    if (one.kind === "line" || one.kind === "step") {
      const source = new Bokeh.ColumnDataSource({ data: { x, y } });
      drawn = one.kind === "line"
        ? figure.line({ field: "x" }, { field: "y" }, { source, ...line })
        : figure.add_glyph(new Bokeh.Step({ x: { field: "x" }, y: { field: "y" }, mode: "after", ...line }), source);
    } else if (one.kind === "points") {
      const tips = one.tips || [], source = new Bokeh.ColumnDataSource({
        data: { x, y, tip: Array.from(x, (_, i) => tips[i] || ""), c: Array.from(x, (_, i) => colour((one.colours || [])[i] || one.colour || "#0072B2")) } });
      drawn = figure.scatter({ field: "x" }, { field: "y" }, {
        source, size, marker: one.marker || "circle", fill_color: { field: "c" }, fill_alpha: alpha, line_color: { field: "c" }, line_alpha: one.alpha === 0 ? 1 : 0.4 * alpha });
      if (tips.length) figure.add_tools(new Bokeh.HoverTool({ renderers: [drawn], tooltips: "<div style='white-space:pre-line;max-width:30em'>@tip</div>" }));
    } else if (one.kind === "area") {
      const source = new Bokeh.ColumnDataSource({ data: { x, y } });
      drawn = figure.patch({ field: "x" }, { field: "y" }, { source, fill_color: ink, fill_alpha: alpha, line_color: ink, line_width: 1 });
    } else if (one.kind === "bars") {
      const source = new Bokeh.ColumnDataSource({ data: { x, y, to } });
      drawn = figure.hbar({ field: "y" }, size, { field: "to" }, { field: "x" }, { source, fill_color: ink, fill_alpha: alpha, line_color: null });
    } else if (one.kind === "span") {
      const ends = x.length ? { left: x[0], right: to[0] } : { bottom: y[0], top: to[0] };
      figure.add_layout(new Bokeh.BoxAnnotation({ ...ends, fill_color: ink, fill_alpha: alpha, line_color: null, level: "underlay" }));
    } else if (one.kind === "rule") {
      figure.add_layout(new Bokeh.Span({ dimension: x.length ? "height" : "width", location: x.length ? x[0] : y[0], ...line }));
      if (label && x.length) figure.tags = [...figure.tags, label]; // one above the other
      if (label) figure.add_layout(new Bokeh.Label({
        x: x.length ? x[0] : 4, y: x.length ? 16 * figure.tags.length - 12 : y[0], [x.length ? "y_units" : "x_units"]: "screen", x_offset: x.length ? 3 : 0, y_offset: 2,
        text: label, text_font_size: "11px", text_color: ink, background_fill_color: colour("paper"), background_fill_alpha: 0.85 }));
    } else if (one.kind === "text") {
      figure.add_layout(new Bokeh.Label({ x: x[0], y: y[0], x_offset: 6, text_baseline: "middle", text: label, text_font_size: "11px", text_color: ink }));
    }
    if (drawn && label) legend.push([label, one.kind === "area" || one.kind === "bars" ? "box" : one.kind === "points" ? "dot" : dash.length ? "dashed" : "line", ink, Math.max(alpha, 0.35), drawn]);
  }

  // The legend beside the picture, so that it takes no room in it; a click hides what it names.
  function legendOf(entries) {
    const list = document.createElement("p");
    list.className = "legend";
    for (const [label, kind, ink, alpha, drawn] of entries) {
      const one = document.createElement("button");
      one.type = "button";
      one.setAttribute("aria-pressed", "true");
      one.innerHTML = `<i class="${kind}" style="--c:${ink};--a:${alpha}"></i>`;
      one.append(label);
      one.addEventListener("click", () => {
        drawn.visible = !drawn.visible;
        one.setAttribute("aria-pressed", String(drawn.visible));
      });
      list.append(one);
    }
    return list;
  }

  async function show(figure, element, entries) {
    element.replaceChildren();
    if (entries && entries.length) element.append(legendOf(entries));
    const place = document.createElement("div");
    element.append(place);
    const view = await Bokeh.Plotting.show(figure, place);
    element.view = view;
    view.canvas_view.events_el.tabIndex = -1; // no key does anything there
    return view;
  }

  function chart(spec, element) {
    const figure = frame(spec), legend = [];
    for (const one of spec.marks) mark(figure, one, legend);
    return show(figure, element, legend.length > 1 ? legend : []);
  }

  // A drawing waits until it comes near the window, or until everything before it is done.
  function later(element, draw) {
    drawings.push({ element, draw, done: false });
  }
  async function run(one) {
    if (one.done) return;
    one.done = true;
    try {
      await one.draw(one.element);
    } catch (error) { // one picture less, not all
      console.error(error);
    }
  }
  const near = (element) => { const box = element.getBoundingClientRect(); return box.bottom > -200 && box.top < innerHeight + 200; };
  async function all() {
    const root = document.documentElement, mine = [...drawings];
    if (watcher) watcher.disconnect();
    watcher = new IntersectionObserver((seen) => {
      for (const entry of seen) if (entry.isIntersecting) run(mine.find((one) => one.element === entry.target));
    }, { rootMargin: "200px" });
    root.dataset.drawn = "";
    for (const one of mine) if (near(one.element)) await run(one);
    root.dataset.drawn = "view";
    performance.mark("view");
    for (const one of mine) watcher.observe(one.element);
    for (const one of mine) {
      await new Promise((next) => (window.requestIdleCallback || setTimeout)(next));
      if (mine[0] !== drawings[0]) return;
      await run(one);
    }
    root.dataset.drawn = "all";
  }

  // Paper: pictures of the canvases, as wide as the column.
  addEventListener("beforeprint", () => {
    for (const element of document.querySelectorAll(".chart, .strip")) {
      if (!element.view) continue;
      const still = document.createElement("canvas"), canvas = element.view.export("png", true).canvas;
      still.className = "still";
      still.width = canvas.width;
      still.height = canvas.height;
      const picture = still.getContext("2d");
      if (dark.matches) { // its inks are for a dark ground
        picture.fillStyle = DARK;
        picture.fillRect(0, 0, still.width, still.height);
      }
      picture.drawImage(canvas, 0, 0);
      element.append(still);
    }
  });
  addEventListener("afterprint", () => document.querySelectorAll("canvas.still").forEach((one) => one.remove()));
  dark.addEventListener("change", () => {
    for (const one of drawings) one.done = false;
    for (const name of Object.keys(ranges)) delete ranges[name];
    all();
  });

  function start(data) {
    self.data = data;
    drawings.length = 0;
    for (const name of Object.keys(ranges)) delete ranges[name];
    for (const element of document.querySelectorAll("[data-chart]"))
      later(element, () => chart(data.charts[Number(element.dataset.chart)], element));
    for (const one of setups) one();
  }
  function setup(one) {
    setups.push(one);
    one();
  }
  // Another report in the place of this one; what is drawn keeps its room, so that nothing jumps.
  async function renew(content, data) {
    const heights = new Map();
    for (const one of document.querySelectorAll("#page .chart")) heights.set(one.id || one.dataset.chart, one.offsetHeight);
    document.getElementById("page").innerHTML = content;
    for (const one of document.querySelectorAll("#page .chart")) one.style.minHeight = `${heights.get(one.id || one.dataset.chart) || 320}px`;
    tables();
    start(data);
    await ready;
    await all();
  }
  const self = { ready, dark, colour, numbers, frame, mark, show, later, ranges, setup, renew };
  start(JSON.parse(document.getElementById("data").textContent));
  addEventListener("DOMContentLoaded", () => ready.then(all));
  return self;
})();
