// Panels over one axis: curves by uPlot, lanes of who conducts when, two cursors and the readings at them.

/** Steps of an axis of decibels, of degrees; others have 1, 2, 2.5 and 5 times powers of ten. */
const STEPS = { dB: [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 40, 100, 200, 500, 1000], "°": [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 5, 15, 45, 90, 180, 360, 720, 1440, 3600] };
/** Of errors: a zero stands at this on a logarithmic axis. */
const LEAST = 1e-17;
/** CSS pixels. */
const SIZES = { axis: 76, label: 18, tick: 22, panel: 224, across: 110, up: 30, right: 26, line: 1.5, dot: 3, pixelsToDrag: 4, box: 40 };
/** The least height of a linear axis over its greatest value: what varies less does so by rounding, and is shown as a straight line. */
const LEAST_HEIGHT = 1e-13;
/** How opaque the inside of an envelope is: what lies behind it is seen. */
const PALE = 0.35;

/** The name of a curve's signal, without the run that it is of. */
const signalOf = ({ name, run }) => (run && name.endsWith(` ${run}`) ? name.slice(0, -run.length - 1) : name);

/**
 * A chart in `root` of { axis: { name, unit, log }, panels: [{ quantity, unit, curves }], strips }. `announce` gets a sentence when a cursor is
 * placed. Colours tell runs where there are several (of more than there are colours by a scale, in their order), and dashes signals. Otherwise colours
 * tell signals, and each panel begins anew where all curves together are more than there are colours. A curve that has a `look` keeps it: its colour
 * and dashes by number, and its part of the scale.
 */
function chart(root, content, announce) {
  const { panels, strips } = content;
  const axis = { ...content.axis };
  const curves = panels.flatMap((panel) => panel.curves);
  const isDotted = panels.some((panel) => panel.dots);
  let whole = wholeSpan(curves, axis.log, isDotted);
  const state = { view: whole, cursors: { a: null, b: null }, pointer: null, under: null, paper: null, plots: [], run: null, room: SIZES.axis, logs: new Set(panels.filter((panel) => panel.dots)), heights: new Map(), fits: new Map() };
  const namesOf = (all) => [...new Set(all.map((curve) => curve.name))];
  const few = namesOf(curves).length <= COLOURS.light.length;
  const runs = [...new Set(curves.map((curve) => curve.run))];
  const isMany = runs.length > COLOURS.light.length;
  const lookOf = (panel, curve) => {
    const at = namesOf(few ? curves : panel.curves).indexOf(curve.name);
    if (!curve.run || runs.length === 1) return [at, Math.floor(at / 8)];
    const run = runs.indexOf(curve.run), signals = [...new Set(panel.curves.map(signalOf))], signal = signals.indexOf(signalOf(curve));
    return isMany ? [run, signal, run / (runs.length - 1)] : [run, signal];
  };
  for (const panel of panels) for (const curve of panel.curves) curve.look ??= lookOf(panel, curve);
  const colour = (curve, paper = isDark() ? "dark" : "light") => (curve.look[2] === undefined ? COLOURS[paper][curve.look[0] % 8] : along(SCALES[paper], curve.look[2]));
  const dash = (curve) => DASHES[curve.look[1] % 4];
  /** What has one name on a panel: a curve, or of many runs all those of a signal. */
  const entriesOf = (panel) => {
    if (!isMany) return panel.curves.map((curve) => ({ name: curve.name, curves: [curve] }));
    const signals = [...new Set(panel.curves.map(signalOf))];
    return signals.map((name) => ({ name, curves: panel.curves.filter((curve) => signalOf(curve) === name) }));
  };
  const isFirst = document.querySelector(".panels") === null;
  const area = element("div", { class: "panels" });
  const stripCanvas = element("canvas", { class: "strip", role: "img" });
  const tip = element("div", { class: "tip", hidden: true });
  const lanes = element("div", { class: "lanes" }, stripCanvas, tip);
  const shown = { axis, panels, curves, strips, runs, isMany, state, colour, dash, toggle, isolate, briefs, unitOf: (curve) => unitOf(curve), shareAt };
  const readings = readingsTable(shown);
  const legend = isMany ? runsLegend(shown) : null;
  root.append(...(legend ? [legend.legend] : []), area, element("div", { class: isMany ? "readings scroll" : "readings" }, readings.table));

  const edgeOf = ([from, to], pixels) =>
    axis.log ? (k) => from * (to / from) ** ((k + 1) / pixels) : (k) => from + ((to - from) * (k + 1)) / pixels;

  /** Bounds of a panel's axis: those chosen, or those of what is seen with a little room; positive where it is logarithmic. */
  function boundsOf(panel) {
    const chosen = state.heights.get(panel);
    if (chosen) return chosen;
    let [low, high] = [Infinity, -Infinity];
    const visible = panel.curves.filter((curve) => curve.shown), fitted = visible.filter((curve) => state.fits.get(panel)?.includes(curve));
    for (const curve of fitted.length > 0 ? fitted : visible) {
      const [a, b] = boundsIn(curve, ...state.view);
      [low, high] = [Math.min(low, a), Math.max(high, b)];
    }
    if (!(low <= high)) return state.logs.has(panel) ? [0.1, 10] : [-1, 1];
    if (state.logs.has(panel) && panel.dots) {
      const seen = panel.curves.filter((curve) => curve.shown).flatMap((curve) => Array.from(curve.y));
      return [Math.max(Math.min(...seen), LEAST) / 2, Math.max(...seen, 10 * LEAST) * 2];
    }
    if (state.logs.has(panel)) {
      high = Math.max(high, -low) || 1;
      return [high * 1e-6, high * 1.5];
    }
    const room = isHigh(panel, low, high) ? 0.06 * (high - low) : 0.1 * sizeOf(panel, low, high) || 1;
    return [low - room, high + room];
  }

  /** The greatest value; a decibel and a degree at least, as these are of ratios. */
  const sizeOf = ({ unit }, low, high) => Math.max(-low, high, STEPS[unit] ? 1 : 0);
  const isHigh = (panel, low, high) => high - low > LEAST_HEIGHT * sizeOf(panel, low, high);

  const pixelsOf = (plot) => Math.max(1, Math.round(plot.bbox.width));

  /** A path of a curve on a plot's canvas; none where it is drawn by its envelope. */
  function path(plot, curve, panel) {
    if (isDense(curve, state.view, pixelsOf(plot))) return null;
    const drawn = new Path2D();
    let pen = false, alone = null;
    const log = state.logs.has(panel), least = panel.dots ? LEAST : Number.MIN_VALUE;
    const ratio = devicePixelRatio || 1, dots = new Path2D();
    const mark = (at, radius) => {
      dots.moveTo(at[0] + radius, at[1]);
      dots.arc(...at, radius, 0, 2 * Math.PI);
    };
    // A row between two gaps has no line.
    const gap = () => {
      if (alone) mark(alone, SIZES.line * ratio * 0.5);
      pen = false;
      alone = null;
    };
    trace(curve, state.view, (t, value) => {
      const y = log ? Math.max(Math.abs(value), least) : value;
      if (Number.isNaN(y)) {
        gap();
        return;
      }
      const at = [plot.valToPos(t, "x", true), plot.valToPos(y, "y", true)];
      if (pen) drawn.lineTo(...at);
      else drawn.moveTo(...at);
      alone = pen ? null : at;
      pen = true;
      if (panel.dots) mark(at, SIZES.dot * ratio);
    });
    gap();
    drawn.addPath(dots);
    return { stroke: drawn };
  }

  /** Draws envelopes below all other curves; filling them takes a hundredth of the time of a stroke of all peaks. */
  function drawDense(plot) {
    const { ctx, bbox, panel } = plot, pixels = pixelsOf(plot), ratio = devicePixelRatio || 1, line = SIZES.line * ratio;
    const height = (y) => Math.min(Math.max(plot.valToPos(y, "y", true), bbox.top - 9), bbox.top + bbox.height + 9);
    const ends = (low, high) => (state.logs.has(panel) ? sizesOf(low, high) : [low, high]).map(height);
    // Kept until something else is shown, or the page moves to a finer screen.
    if (plot.pixels !== pixels) panel.curves.forEach((curve) => { curve.bars = null; });
    plot.pixels = pixels;
    const barsOf = (curve) => (isDense(curve, state.view, pixels) ? envelope(curve, state.view, pixels, edgeOf(state.view, pixels), ends, line) : []);
    const shown = panel.curves.filter((curve) => curve.shown);
    for (const curve of shown) curve.bars ??= barsOf(curve);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    // Pixels side by side would leave seams where they began at parts of one.
    const left = Math.round(bbox.left);
    const fill = (pixel, from, to) => { if (to > from) ctx.fillRect(left + pixel, from, 1, to - from); };
    ctx.globalAlpha = PALE;
    for (const curve of shown) {
      ctx.fillStyle = colour(curve);
      for (const [pixel, , , from, to] of curve.bars) fill(pixel, from, to);
    }
    ctx.globalAlpha = 1;
    for (const curve of shown) {
      const dashes = dash(curve);
      ctx.fillStyle = colour(curve);
      for (const [pixel, top, bottom, from, to, isStraight] of curve.bars) {
        // Of a curve that winds, dashes would leave nothing to see.
        if (isStraight && bottom - top < 2 * line && isDashGap(dashes, pixel / ratio)) continue;
        fill(pixel, top, from);
        fill(pixel, to, bottom);
      }
    }
    ctx.restore();
  }

  function plotOf(panel, last) {
    const ink = () => themed("--ink"), grid = () => themed("--grid");
    const lines = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 } };
    const series = panel.curves.map((curve) => ({
      label: curve.name,
      stroke: () => colour(curve),
      dash: dash(curve),
      width: SIZES.line,
      show: curve.shown,
      points: { show: false },
      paths: (plot) => path(plot, curve, panel),
    }));
    const holder = element("div", { class: "panel", tabindex: 0, role: "group", "aria-label": `${panel.quantity}: ${panel.curves.map((c) => c.name).join(", ")}` });
    const entries = entriesOf(panel).map((entry, _, all) => namedOn(panel, entry, all.length));
    const names = element("p", { class: "names" }, ...entries.map((entry) => entry.holder));
    holder.append(names);
    area.append(holder);
    const options = {
      width: widthOf(),
      height: SIZES.panel,
      padding: [8, SIZES.right, 0, 0],
      legend: { show: false },
      scales: {
        // What is seen, not rounded to whole decades.
        x: { time: false, auto: false, distr: axis.log ? 3 : 1, range: () => state.view },
        y: { auto: false, distr: state.logs.has(panel) ? 3 : 1, range: () => boundsOf(panel) },
      },
      axes: [
        { ...lines, ...marks(axis.unit, axis.log, SIZES.across), size: last ? 34 : 28 },
        { ...lines, ...marks(panel.unit, state.logs.has(panel), SIZES.up), label: panel.quantity, labelSize: SIZES.label, labelFont: "12px system-ui, sans-serif", size: roomOf },
      ],
      series: [{}, ...series],
      cursor: { y: false, points: { show: false }, drag: { x: true, y: true, uni: SIZES.box, setScale: false, click: () => {} }, bind: { dblclick: () => full } },
      hooks: {
        setSelect: [
          (plot) => {
            const { left, width, top, height } = plot.select;
            const [isWide, isUpright] = [width < plot.over.clientWidth, height < plot.over.clientHeight];
            const isDrag = Math.max(isWide ? width : 0, isUpright ? height : 0) > SIZES.pixelsToDrag;
            const bounds = [plot.posToVal(top + height, "y"), plot.posToVal(top, "y")];
            if (isDrag && isUpright && isHigh(panel, ...bounds)) state.heights.set(panel, bounds);
            if (isDrag) show(isWide ? [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")] : state.view);
            if (width > 0) plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          },
        ],
        setCursor: [(plot) => point(plot)],
        drawAxes: [drawDense],
        draw: [(plot) => drawCursors(plot)],
      },
    };
    const plot = new uPlot(options, [whole, ...panel.curves.map(() => [null, null])], holder);
    Object.assign(plot, { panel, entries });
    bind(plot.over, (event) => plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    holder.addEventListener("keydown", pressed);
    return plot;
  }

  /** Where an axis has lines and labels, at least `space` pixels apart. */
  function marks(unit, log, space) {
    const room = (plot) => (space === SIZES.across ? plot.bbox.width : plot.bbox.height) / (devicePixelRatio || 1);
    // uPlot's own steps are no less than 1e-17.
    if (!log) return { splits: (plot, _, low, high) => evenSplits(low, high, ((high - low) * space) / room(plot), STEPS[unit]), values: (_, splits) => ticks(splits, unit) };
    return {
      splits: (plot, _, low, high) => logSplits(low, high, room(plot) / space),
      filter: (plot, splits) => logLabels(splits, room(plot) / space),
      values: (_, splits) => (unit === "" ? ticks(splits, unit) : splits.map((value) => (value == null ? null : quantity(value, unit)))),
    };
  }

  /** Room for the labels of values: as much as the longest of all panels takes, as these have one axis across. */
  function roomOf({ ctx, axes }, labels) {
    ctx.save();
    ctx.font = axes[1].font[0];
    const widths = (labels ?? []).map((label) => (label ? ctx.measureText(label).width / (devicePixelRatio || 1) : 0));
    ctx.restore();
    return (state.room = Math.max(state.room, Math.ceil(Math.max(0, ...widths)) + SIZES.tick));
  }

  /** The window says nothing of how wide paper is. */
  const widthOf = () => state.paper ?? Math.max(280, root.clientWidth);

  function build() {
    state.plots.forEach((plot) => plot.destroy());
    area.replaceChildren();
    state.plots = panels.map((panel, k) => plotOf(panel, k + 1 === panels.length));
    if (strips.length > 0) {
      labelLanes();
      area.append(lanes);
    }
    show(state.view);
    readings.update();
  }

  const labelLanes = () =>
    stripCanvas.setAttribute("aria-label", `who conducts when${state.run ? ` in the run ${state.run}` : ""}: ${strips.map((strip) => strip.name).join(", ")}; states at the cursors and shares of time between them stand in the table`);

  /** Draws lanes and their readings anew, whose strips are those of another run now. */
  function anew(run) {
    state.run = run;
    labelLanes();
    readings.renew();
    retold();
  }

  /** Shows a span of the axis in all panels. */
  function show([from, to]) {
    const least = axis.log ? from * 1e-9 : 1e-13 * Math.max(Math.abs(whole[0]), Math.abs(whole[1]));
    if (!(to - from > least)) return;
    state.view = [Math.max(from, whole[0]), Math.min(to, whole[1])];
    if (!(state.view[1] > state.view[0])) state.view = whole;
    state.room = SIZES.axis;
    for (const curve of curves) curve.bars = null;
    for (const plot of state.plots) {
      plot.entries.forEach((entry) => entry.update());
      plot.batch(() => {
        plot.redraw(true, true);
        // Asks for the ranges of scales: spans that are handed over are left out where they are below 1e-16.
        for (const scale of ["x", "y"]) plot.setScale(scale, { min: null, max: null });
      });
    }
    // A later panel may have longer labels than one before.
    for (const plot of state.plots) if (plot.axes[1]._size < state.room) plot.batch(() => plot.redraw(true, true));
    area.style.setProperty("--left", `${(100 * (SIZES.label + state.room)) / widthOf()}%`);
    drawStrips();
    legend?.update();
    root.dispatchEvent(new CustomEvent("view", { detail: state.view }));
  }

  /** Shows the whole span of all panels. */
  function full() {
    state.heights.clear();
    state.fits.clear();
    show(whole);
  }

  /** Zooms by a factor about x, which stays where it is. */
  function zoom(factor, x) {
    const [from, to] = state.view;
    if (axis.log) show([x * (from / x) ** factor, x * (to / x) ** factor]);
    else show([x + (from - x) * factor, x + (to - x) * factor]);
  }

  /** Moves the view by a part of its width. */
  function pan(part) {
    const [from, to] = state.view;
    if (axis.log) {
      const ratio = Math.min(Math.max((to / from) ** part, whole[0] / from), whole[1] / to);
      show([from * ratio, to * ratio]);
    } else {
      const move = Math.min(Math.max((to - from) * part, whole[0] - from), whole[1] - to);
      show([from + move, to + move]);
    }
  }

  const centre = () => (axis.log ? Math.sqrt(state.view[0] * state.view[1]) : (state.view[0] + state.view[1]) / 2);
  /** Where the rows are that cursors stand on: of a curve that is seen, where one has any. */
  function guide() {
    const some = curves.filter((curve) => curve.x.length > 0);
    return (some.find((curve) => curve.shown) ?? some[0])?.x;
  }

  /** Puts a cursor on the row nearest to x. */
  function place(name, x) {
    const rows = guide();
    if (!rows) return;
    state.cursors[name] = rows[nearestRow(rows, x)];
    retell(name);
  }

  /** Moves a cursor by a row. */
  function step(name, by) {
    const rows = guide();
    if (!rows) return;
    const t = state.cursors[name] ?? centre();
    const next = by > 0 ? rowAfter(rows, t) : rowAt(rows, t) - 1;
    state.cursors[name] = rows[Math.min(Math.max(next, 0), rows.length - 1)];
    retell(name);
  }

  /** The steps that give curves which are drawn by some of their rows all of them, from columns by number: one a curve, then what is seen of them. */
  const completing = (columns) => [
    ...curves.filter((curve) => curve.partial).map((curve) => () => {
      const [x, y] = curve.later.map((k) => columns.get(k));
      Object.assign(curve, curveOf(curve.name, x, y), { shown: curve.shown });
    }),
    () => {
      show(state.view);
      readings.update();
      root.dispatchEvent(new CustomEvent("complete"));
    },
  ];

  /** Draws the cursors and their readings anew. */
  function retold() {
    state.plots.forEach((plot) => plot.redraw(false));
    drawStrips();
    readings.update();
    root.dispatchEvent(new CustomEvent("cursor"));
  }

  function retell(name) {
    retold();
    const t = state.cursors[name];
    const told = curves.filter((curve) => curve.shown).map((curve) => `${curve.name} ${quantity(valueAt(curve, t), unitOf(curve))}`);
    told.push(...strips.map((strip) => `${strip.name} ${stateWords(strip, stateAt(strip, t))}`));
    announce(`Cursor ${name.toUpperCase()} at ${quantity(t, axis.unit, 9)}: ${told.join(", ")}`);
  }

  const unitOf = (curve) => panels.find((panel) => panel.curves.includes(curve)).unit;

  /** The mouse over what shows the view: `at(event)` is where it points to. */
  function bind(over, at) {
    let dragged = null;
    over.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (event.shiftKey) pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
      else zoom(event.deltaY > 0 ? 1.25 : 0.8, at(event));
    }, { passive: false });
    // Shift and drag moves the view; a press that does not move places a cursor.
    over.addEventListener("mousedown", (event) => {
      dragged = { x: event.clientX, from: event.clientX, top: event.clientY, shift: event.shiftKey };
      if (event.shiftKey) event.stopImmediatePropagation();
    }, true);
    over.addEventListener("mousemove", (event) => {
      if (dragged?.shift && event.buttons & 1) {
        pan((dragged.x - event.clientX) / state.plots[0].over.clientWidth);
        dragged.x = event.clientX;
      }
    });
    over.addEventListener("click", (event) => {
      const moved = dragged && Math.max(Math.abs(event.clientX - dragged.from), Math.abs(event.clientY - dragged.top));
      if (dragged && moved <= SIZES.pixelsToDrag) place(event.shiftKey ? "b" : "a", at(event));
      dragged = null;
    });
  }

  function pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const x = state.pointer ?? centre();
    const keys = {
      "+": () => zoom(0.5, x), "=": () => zoom(0.5, x), "-": () => zoom(2, x),
      ArrowLeft: () => pan(-0.2), ArrowRight: () => pan(0.2), Home: full,
      a: () => place("a", x), b: () => place("b", x),
      ",": () => step("a", -1), ".": () => step("a", 1), "<": () => step("b", -1), ">": () => step("b", 1),
      Escape: () => { state.cursors = { a: null, b: null }; retold(); announce(""); },
    };
    if (keys[event.key]) {
      event.preventDefault();
      keys[event.key]();
    }
  }

  /** Keys that are pressed where nothing else takes them are those of the page's first chart. */
  function pressedOnPage(event) {
    if (isFirst && !event.target.closest?.("input:not([type=checkbox]), textarea, select, [contenteditable], .panel")) pressed(event);
  }

  function point(plot) {
    const { left, top } = plot.cursor;
    pointTo(left >= 0 ? plot.posToVal(left, "x") : null, plot, top);
  }

  /** The pointer is at x, over a plot or none. */
  function pointTo(x, plot, top) {
    if (x === state.pointer && (!isMany || (state.under?.plot === plot && state.under?.top === top))) return;
    [state.pointer, state.under] = [x, x === null || !plot ? null : { plot, top }];
    for (const other of state.plots) {
      if (other !== plot) other.setCursor({ left: x === null ? -10 : other.valToPos(x, "x"), top: 0 }, false);
    }
    readings.update();
  }

  function drawCursors(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    const seen = Object.entries(state.cursors).filter(([, t]) => t !== null && t >= state.view[0] && t <= state.view[1]);
    const places = seen.map(([, t]) => Math.round(plot.valToPos(t, "x", true)) + 0.5).sort((one, other) => one - other);
    const areClose = places[1] - places[0] < 16 * devicePixelRatio;
    for (const [name, t] of seen.sort(([, one], [, other]) => one - other)) {
      const x = places.shift();
      ctx.strokeStyle = ctx.fillStyle = themed(name === "a" ? "--cursor-a" : "--cursor-b");
      ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      // Of two that are close the first has its letter before it.
      const isBefore = areClose && places.length > 0;
      ctx.textAlign = isBefore ? "right" : "left";
      ctx.fillText(name.toUpperCase(), x + (isBefore ? -3 : 3) * devicePixelRatio, bbox.top + 11 * devicePixelRatio);
    }
    ctx.restore();
  }

  /** Where times stand beside the lanes, which are as wide as the panels. */
  function across() {
    const [from, to] = state.view, width = widthOf(), left = SIZES.label + state.room, room = width - left - SIZES.right;
    const position = (t) => left + room * (axis.log ? Math.log(t / from) / Math.log(to / from) : (t - from) / (to - from));
    const timeAt = (x) => (axis.log ? from * (to / from) ** ((x - left) / room) : from + ((to - from) * (x - left)) / room);
    const isClose = (a, b) => position(b) - position(a) < LANES.period;
    return { view: state.view, width, left, room, position, timeAt, isClose };
  }

  function drawStrips() {
    if (strips.length === 0) return;
    const seen = Object.entries(state.cursors).filter(([, t]) => t !== null && t >= state.view[0] && t <= state.view[1]);
    drawLanes(stripCanvas, strips, across(), seen.map(([name, t]) => [t, themed(name === "a" ? "--cursor-a" : "--cursor-b")]));
  }

  /** The share of time on about t, null where changes can be told apart. */
  function shareAt(strip, t) {
    const { view, position, timeAt, isClose } = across(), x = position(t);
    const piece = pieceAt(strip, t, view, isClose);
    return piece?.changes ? shareAbout(strip, timeAt(x - 0.5), timeAt(x + 0.5), piece.changes) : null;
  }

  /** What the lane under the pointer shows there, in words. */
  function tell(event) {
    const box = stripCanvas.getBoundingClientRect(), x = event.clientX - box.left, { view, left, room, timeAt, isClose } = across();
    const strip = strips[Math.floor((event.clientY - box.top - 2) / LANES.row)];
    tip.hidden = !strip || x < left || x > left + room;
    pointTo(tip.hidden ? null : timeAt(x));
    if (tip.hidden) return;
    const t = timeAt(x);
    tip.textContent = words(strip, t, [timeAt(x - 0.5), timeAt(x + 0.5)], pieceAt(strip, t, view, isClose));
    const isRight = x > left + room / 2;
    Object.assign(tip.style, { top: `${event.clientY - box.top + 14}px`, left: isRight ? "auto" : `${x}px`, right: isRight ? `${box.width - x}px` : "auto" });
  }

  /** A name on a panel: it shows and hides its curves, tells their value at the pointer or the cursors, and fits the axis to them. */
  function namedOn(panel, { name, curves: own }, howMany) {
    const act = (event) => {
      const visible = new Set(curves.filter((curve) => curve.shown).map((curve) => curve.run));
      const meant = own.filter((curve) => visible.has(curve.run) || visible.size === 0);
      if (event.shiftKey || event.type === "dblclick") isolate(meant, panel.curves);
      else toggle(meant.length > 0 ? meant : own, !own.some((curve) => curve.shown));
    };
    const line = element("span", { class: "swatch", "aria-hidden": "true" });
    const button = element("button", { type: "button", title: "show or hide; double click, or shift and click: this alone", onclick: act, ondblclick: act }, line, name);
    const value = element("span", { class: "value", "aria-hidden": "true" });
    const fit = element("button", { type: "button", class: "fit", "aria-label": `fit the axis to ${name}`, title: `fit the axis of values to ${name}; once more: to all`, onclick: () => {
      if (state.fits.get(panel) === own) state.fits.delete(panel);
      else state.fits.set(panel, own);
      state.heights.delete(panel);
      show(state.view);
    } }, "⇕");
    const update = () => {
      button.setAttribute("aria-pressed", String(own.some((curve) => curve.shown)));
      fit.setAttribute("aria-pressed", String(state.fits.get(panel) === own));
      line.style.background = own.length === 1 ? swatch(colour(own[0]), dash(own[0])) : swatch(themed("--ink"), dash(own[0]));
    };
    return { curves: own, value, update, holder: element("span", {}, button, ...(howMany > 1 ? [fit] : []), value) };
  }

  /** What stands beside names: values at the pointer, without one the difference of both cursors or the values at the only one. */
  function briefs({ pointer, a, b }, both) {
    for (const plot of state.plots) for (const { curves: own, value } of plot.entries) value.textContent = brief(plot, own.filter((curve) => curve.shown || own.length === 1));
    function brief(plot, own) {
      const told = (t, curve) => quantity(valueAt(curve, t), plot.panel.unit);
      if (own.length !== 1) {
        // Of many runs the one that is nearest to the pointer.
        if (state.under?.plot !== plot || own.length === 0) return "";
        const away = (curve) => { const y = valueAt(curve, pointer); return Number.isNaN(y) ? Infinity : Math.abs(plot.valToPos(y, "y") - state.under.top); };
        const near = own.map((curve) => [away(curve), curve]).reduce((one, other) => (other[0] < one[0] ? other : one))[1];
        return `${near.run}: ${told(pointer, near)}`;
      }
      const [curve] = own;
      if (pointer !== null) return told(pointer, curve);
      if (both) return `B − A ${quantity(valueAt(curve, b) - valueAt(curve, a), plot.panel.unit)}`;
      return a !== null ? `A ${told(a, curve)}` : b !== null ? `B ${told(b, curve)}` : "";
    }
  }

  function toggle(some, shown) {
    for (const curve of some) {
      curve.shown = shown;
      for (const plot of state.plots) {
        const k = plot.panel.curves.indexOf(curve);
        if (k >= 0) plot.setSeries(k + 1, { show: shown });
      }
    }
    readings.tick();
    show(state.view);
  }

  /** Shows some of these curves alone; where they are alone, all. */
  function isolate(some, of) {
    const isAlone = of.every((curve) => curve.shown === some.includes(curve));
    toggle(of.filter((curve) => !isAlone && !some.includes(curve)), false);
    toggle(isAlone ? of : some, true);
  }

  /** Logarithmic or linear axes of values. */
  function logarithmic(on) {
    state.logs = new Set(on ? panels : []);
    state.heights.clear();
    build();
  }

  /** A logarithmic or linear axis across; what is not positive has no place on the former. */
  function logarithmicAcross(on) {
    const isWhole = state.view[0] === whole[0] && state.view[1] === whole[1];
    axis.log = on;
    whole = wholeSpan(curves, on, isDotted);
    if (isWhole || state.view[0] < whole[0]) state.view = [whole[0], isWhole ? whole[1] : state.view[1]];
    build();
  }

  /** What a reader chose to see, by names. */
  const keep = () => ({
    view: state.view[0] === whole[0] && state.view[1] === whole[1] ? null : state.view,
    heights: panels.map((panel) => state.heights.get(panel) ?? null),
    cursors: state.cursors,
    hidden: curves.filter((curve) => !curve.shown).map((curve) => curve.name),
    fits: panels.map((panel) => (state.fits.get(panel) ?? []).map((curve) => curve.name)),
  });

  /** Shows that again. */
  function restore({ view, heights, cursors, hidden, fits }) {
    for (const { panel, entries } of state.plots) {
      const fitted = entries.find(({ curves }) => (fits ?? []).some((names) => names.includes(curves[0].name)));
      if (fitted) state.fits.set(panel, fitted.curves);
    }
    toggle(curves.filter((curve) => hidden.includes(curve.name)), false);
    state.cursors = cursors;
    heights.forEach((bounds, k) => { if (bounds && panels[k]) state.heights.set(panels[k], bounds); });
    show(view ?? state.view);
    retold();
  }

  const isFit = (plot) => plot.width === widthOf();

  /** Draws all anew, for paper of so many pixels or else the window. */
  function repaint(paper = null) {
    state.paper = paper;
    for (const plot of state.plots) if (!isFit(plot)) plot.setSize({ width: widthOf(), height: SIZES.panel });
    show(state.view);
    readings.update();
  }

  const resized = new ResizeObserver(() => { if (!state.plots.every(isFit)) repaint(state.paper); });
  if (strips.length > 0) {
    bind(stripCanvas, (event) => across().timeAt(event.clientX - stripCanvas.getBoundingClientRect().left));
    stripCanvas.addEventListener("mousemove", tell);
    stripCanvas.addEventListener("mouseleave", () => { tip.hidden = true; pointTo(null); });
  }
  build();
  resized.observe(root);
  document.addEventListener("keydown", pressedOnPage);
  const paper = matchMedia("(prefers-color-scheme: dark)"), recolour = () => repaint(state.paper);
  paper.addEventListener("change", recolour);
  return {
    state, panels, strips, runs, isMany, entriesOf, show, completing, anew, keep, restore, zoom, pan, place, logarithmic, logarithmicAcross, colour, dash, boundsOf, edgeOf, axis,
    full,
    repaint,
    remove: () => { resized.disconnect(); document.removeEventListener("keydown", pressedOnPage); paper.removeEventListener("change", recolour); state.plots.forEach((plot) => plot.destroy()); root.replaceChildren(); },
  };
}

/** First and last x of all curves, with room for dots; positive for a logarithmic axis. */
function wholeSpan(curves, log, dots) {
  let [from, to] = [Infinity, -Infinity];
  for (const { x } of curves) {
    if (x.length === 0) continue;
    from = Math.min(from, log ? (x.find((value) => value > 0) ?? Infinity) : x[0]);
    to = Math.max(to, x[x.length - 1]);
  }
  if (!(from <= to)) return log ? [1, 10] : [0, 1];
  if (log) return from < to && !dots ? [from, to] : [from / 1.5, to * 1.5];
  if (dots) return [from - 0.03 * (to - from || 1), to + 0.03 * (to - from || 1)];
  return from < to ? [from, to] : [from - (Math.abs(from) || 1) / 2, from + (Math.abs(from) || 1) / 2];
}
