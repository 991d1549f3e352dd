// The page: headline, controls, charts, tables and text of one result.

/** Rows of a table that are written at once; the rest on request. */
const ROWS = 500;

/** Strips from lists of changes, [t, on] each. */
function stripsOf(strips) {
  return (strips ?? []).map((strip) => ({ ...strip, times: numbers(strip.times), states: strip.states.map(Boolean) }));
}

/** Panels of curves over the columns of the data; curves whose columns follow later are drawn by their overviews until then. */
function panelsOf(data) {
  const columns = data.columns.map((column) => column && numbers(column));
  const of = (curve) => {
    const { name, run } = curve;
    if (columns[curve.x] && columns[curve.y]) return { ...curveOf(name, columns[curve.x], columns[curve.y]), run };
    const [x, y] = curve.overview;
    return { ...curveOf(name, columns[x], columns[y]), run, partial: true, later: [curve.x, curve.y] };
  };
  return data.panels.map((panel) => ({ ...panel, curves: panel.curves.map(of) }));
}

/** The columns that stand behind the page are there: its curves get all their rows. */
function circRest(shown) {
  const columns = new Map();
  for (const script of document.querySelectorAll("script[data-column]")) {
    columns.set(Number(script.dataset.column), numbers(script.textContent));
    script.remove();
  }
  shown.complete(columns);
}

/** A table of words; long ones show their first rows and a button for the rest. */
function wordTable({ heading, header, rows, all }) {
  const body = element("tbody");
  const line = (cells) => element("tr", {}, ...cells.map((cell) => element("td", {}, cell)));
  body.append(...rows.slice(0, ROWS).map(line));
  const table = element("table", { class: "words" }, element("thead", {}, element("tr", {}, ...header.map((name) => element("th", { scope: "col" }, name)))), body);
  const scroll = element("div", { class: "scroll", role: "region", tabindex: 0, "aria-label": heading }, table);
  const section = element("details", { open: rows.length <= 40 }, element("summary", {}, `${heading} (${all > rows.length ? `the first ${rows.length} of ${all}` : rows.length})`), scroll);
  if (rows.length > ROWS) {
    const more = element("button", { type: "button", onclick: () => { body.append(...rows.slice(ROWS).map(line)); more.remove(); } }, `${rows.length} rows`);
    section.append(more);
  }
  return section;
}

/** What charts show, each under its heading, as a drawing in SVG. */
function drawing(charts) {
  const longest = Math.max(...charts.flatMap(([shown]) => shown.state.plots.flatMap((plot) => plot.axes[1]._values.map((label) => label?.length ?? 0))));
  const width = 900, left = Math.max(90, 7 * longest + 14), right = 20, inner = width - left - right, room = 190;
  const clean = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const parts = [];
  let base = 0, panelsSoFar = 0;
  for (const [shown, heading] of charts) {
    const { axis, panels, state } = shown;
    const [from, to] = state.view;
    const across = (x) => left + inner * (axis.log ? Math.log(x / from) / Math.log(to / from) : (x - from) / (to - from));
    parts.push(`<text x="${left}" y="${base + 18}" font-size="15">${clean(heading)}</text>`);
    base += 40;
    panels.forEach((panel, k) => {
      const plot = state.plots[k], clip = `p${panelsSoFar++}`;
      const curves = panel.curves.filter((curve) => curve.shown);
      // Names, in as many lines as they take.
      let column = left;
      for (const curve of curves) {
        const needs = 8 * curve.name.length + 44, colour = shown.colour(curve, "light");
        if (column > left && column + needs > width) [column, base] = [left, base + 16];
        parts.push(`<path d="M${column} ${base - 10}h24" stroke="${colour}" stroke-width="2" stroke-dasharray="${shown.dash(curve).join(" ")}"/>`);
        parts.push(`<text x="${column + 30}" y="${base - 6}" fill="${colour}">${clean(curve.name)}</text>`);
        column += needs;
      }
      const top = base, [low, high] = shown.boundsOf(panel), log = state.logs.has(panel);
      const up = (y) => top + room * (1 - (log ? Math.log(Math.max(Math.abs(y), low) / low) / Math.log(high / low) : (y - low) / (high - low)));
      const marks = (a) => plot.axes[a]._splits.map((value, j) => [value, plot.axes[a]._values[j]]).filter(([, label]) => label);
      for (const [x, label] of marks(0)) {
        parts.push(`<path d="M${across(x).toFixed(2)} ${top}v${room}" stroke="#ddd"/><text x="${across(x).toFixed(2)}" y="${top + room + 15}" text-anchor="middle">${clean(label)}</text>`);
      }
      for (const [y, label] of marks(1)) {
        parts.push(`<path d="M${left} ${up(y).toFixed(2)}H${width - right}" stroke="#ddd"/><text x="${left - 6}" y="${(up(y) + 4).toFixed(2)}" text-anchor="end">${clean(label)}</text>`);
      }
      const layers = { inside: "", outline: "", line: "" };
      for (const curve of curves) {
        const colour = shown.colour(curve, "light"), dash = shown.dash(curve);
        if (isDense(curve, state.view, inner)) {
          const box = (pixel, y, end) => (end > y ? `M${left + pixel} ${y.toFixed(2)}h1V${end.toFixed(2)}h-1z` : "");
          let inside = "", outline = "";
          envelope(curve, state.view, inner, shown.edgeOf(state.view, inner), (a, b) => (log ? sizesOf(a, b) : [a, b]).map(up), SIZES.line).forEach(([pixel, y, end, a, b, isStraight]) => {
            inside += box(pixel, a, b);
            if (!isStraight || end - y >= 2 * SIZES.line || !isDashGap(dash, pixel)) outline += box(pixel, y, a) + box(pixel, b, end);
          });
          layers.inside += `<path d="${inside}" fill="${colour}" fill-opacity="${PALE}" shape-rendering="crispEdges"/>`;
          layers.outline += `<path d="${outline}" fill="${colour}" data-signal="${clean(curve.name)}"/>`;
          continue;
        }
        let path = "", pen = "M";
        trace(curve, state.view, (x, y) => {
          if (Number.isNaN(y)) pen = "M";
          else { path += `${pen}${across(x).toFixed(2)} ${up(y).toFixed(2)}`; pen = "L"; }
        });
        layers.line += `<path d="${path}" fill="none" stroke="${colour}" stroke-width="1.5" stroke-dasharray="${dash.join(" ")}" data-signal="${clean(curve.name)}"/>`;
      }
      parts.push(`<clipPath id="${clip}"><rect x="${left}" y="${top}" width="${inner}" height="${room}"/></clipPath><g clip-path="url(#${clip})">${layers.inside}${layers.outline}${layers.line}</g>`);
      base += room + 50;
    });
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${base}" viewBox="0 0 ${width} ${base}" font-family="sans-serif" font-size="12">` +
    `<rect width="${width}" height="${base}" fill="#fff"/>${parts.join("")}</svg>`;
}

/** The picture of the circuit, with what conducts at cursor A coloured. */
function circuitOf(svg, shown, area) {
  const picture = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement;
  const when = element("p", { class: "about" });
  const section = element("details", { open: true, class: "circuit" }, element("summary", {}, "Circuit"), when, document.importNode(picture, true));
  // A large one is not shrunk until nobody can read it: it can be moved.
  const drawn = section.querySelector("svg");
  drawn.style.minWidth = `${0.7 * (Number.parseFloat(drawn.getAttribute("width")) || 0)}px`;
  const states = section.querySelectorAll(".device");
  const update = () => {
    const t = shown?.state.cursors.a ?? null;
    const strips = new Map((shown?.strips ?? []).map((strip) => [strip.name, strip]));
    when.textContent = states.length === 0 || strips.size === 0 ? "" : t === null ? "Cursor A (a click on a curve) colours what conducts there." : `What conducts at ${quantity(t, "s", 9)} is coloured.`;
    for (const state of states) {
      // A transistor conducts where its channel or its body diode does.
      const device = state.dataset.device;
      const parts = [...strips.values()].filter(({ name }) => name === device || name.startsWith(`${device}.`));
      const on = t !== null && parts.some((strip) => stateAt(strip, t) === true);
      state.setAttribute("display", on === (state.dataset.on === "1") ? "inline" : "none");
    }
  };
  area.addEventListener("cursor", update);
  update();
  return section;
}

/** Hands a text to the reader as a file. */
function save(name, type, text) {
  const link = element("a", { download: name, href: URL.createObjectURL(new Blob([text], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Shows a result in `root`; see `report::html` for what `data` holds. Returns the chart, if there are curves. */
function circPage(root, data) {
  const live = element("output", { class: "live", "aria-live": "polite" });
  const announce = (words) => { live.textContent = words; };
  const panels = panelsOf(data);
  const area = element("section", { "aria-label": "waveforms" });
  const spectrumArea = element("section", { "aria-label": "spectrum", hidden: true });
  const controls = element("div", { class: "controls", role: "toolbar", "aria-label": "view" });
  root.replaceChildren(element("h1", {}, data.title), element("p", { class: "about" }, data.about ?? ""), controls, area, live, spectrumArea);
  let shown = null, spectrum = null;
  const button = (words, action, title) => {
    const made = element("button", { type: "button", title, onclick: () => action(made) }, words);
    controls.append(made);
    return made;
  };
  const pressed = (made) => {
    const on = made.getAttribute("aria-pressed") !== "true";
    made.setAttribute("aria-pressed", String(on));
    return on;
  };
  /** Buttons for the axes of a chart; what they say is kept in `looks` for one that is made anew. */
  function axes(bar, of, looks) {
    const toggle = (words, key, act, title) => {
      const made = element("button", { type: "button", title, onclick: () => { looks[key] = pressed(made); act(of())(looks[key]); } }, words);
      made.setAttribute("aria-pressed", String(looks[key]));
      bar.append(made);
    };
    toggle("log x", "x", (chart) => chart.logarithmicAcross, "logarithmic axis across");
    toggle("log y", "y", (chart) => chart.logarithmic, "logarithmic axis of absolute values");
  }
  const spectrumLooks = { x: true, y: false };
  const spectrumWords = element("p", { class: "about" });
  /** Straight lines between rows that are far apart make lines of their own, below half the rate of rows too. */
  function spectrumNote() {
    const gap = Math.max(...shown.panels.flatMap((panel) => panel.curves.filter((curve) => curve.shown)).map((curve) => widestGap(curve.x, ...shown.state.view)));
    spectrumWords.textContent = gap > 0
      ? `Rows are up to ${quantity(gap, "s", 3)} apart here and curves straight between them: what moves within ${quantity(10 * gap, "s", 3)} can make lines that are not there, lower ones too. A shorter print step (.tran) tells.`
      : "";
  }
  function transformed() {
    spectrum?.remove();
    spectrumNote();
    const of = shown.panels.map((panel) => ({
      ...panel,
      curves: panel.curves.filter((curve) => curve.shown).map((curve) => ({ ...spectrumOf(curve, ...shown.state.view), run: curve.run, look: curve.look })),
    })).filter((panel) => panel.curves.length > 0);
    spectrumArea.hidden = false;
    if (spectrumArea.childElementCount === 0) {
      const bar = element("div", { class: "controls", role: "toolbar", "aria-label": "axes of the spectrum" });
      axes(bar, () => spectrum, spectrumLooks);
      spectrumArea.append(element("h2", {}, "Spectrum of what is seen"), spectrumWords, bar, element("div"));
      spectrumArea.scrollIntoView({ block: "nearest" });
    }
    spectrum = chart(spectrumArea.lastChild, { axis: { name: "frequency", unit: "Hz", log: spectrumLooks.x }, panels: of, strips: [] }, announce);
    if (spectrumLooks.y) spectrum.logarithmic(true);
  }
  if (panels.some((panel) => panel.curves.length > 0)) {
    button("−", () => shown.zoom(2, middle()), "zoom out (key −)");
    button("+", () => shown.zoom(0.5, middle()), "zoom in (key +, wheel, drag of a span, a box or a height)");
    button("◀", () => shown.pan(-0.2), "earlier (left arrow, shift and drag)");
    button("▶", () => shown.pan(0.2), "later (right arrow)");
    button("all", () => shown.full(), "the whole span (key Home, double click)");
    axes(controls, () => shown, { x: data.axis.log, y: panels.every((panel) => panel.dots) });
    if (data.axis.name === "time") {
      const spectral = button("spectrum", (made) => {
        if (pressed(made)) transformed();
        else { spectrum.remove(); spectrum = null; spectrumArea.hidden = true; }
      }, "spectrum of what is seen, by fast Fourier transform");
      spectral.setAttribute("aria-pressed", "false");
      if (panels.some((panel) => panel.curves.some((curve) => curve.partial))) {
        const wait = element("span", {}, " · reading all rows …");
        root.querySelector(".about").append(wait);
        spectral.disabled = true;
        area.addEventListener("complete", () => { wait.remove(); spectral.disabled = false; });
      }
    }
    button("save SVG", () => save("circ.svg", "image/svg+xml", drawing([[shown, data.title], ...(spectrum ? [[spectrum, "Spectrum"]] : [])])), "what is seen as a drawing, the spectrum too");
  }
  button("dark / light", () => {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    shown?.repaint();
    spectrum?.repaint();
  }, "colours of the page");
  const middle = () => { const [from, to] = shown.state.view; return shown.axis.log ? Math.sqrt(from * to) : (from + to) / 2; };
  if (panels.some((panel) => panel.curves.length > 0)) {
    shown = chart(area, { axis: data.axis, panels, strips: stripsOf(data.strips) }, announce);
    area.addEventListener("view", () => { if (spectrum && !spectrumArea.hidden) transformed(); });
    root.append(element("details", {}, element("summary", {}, "Keys and mouse"), element("p", {},
      "Drag: zoom to a span, a box or a height. Wheel: zoom at the pointer; with shift, move. Shift and drag: move. Double click or Home: all. Click: cursor A; shift and click: cursor B; a click on a name shows or hides its curve. " +
      "Keys: + − ← → Home; a, b place a cursor at the pointer (without one, in the middle); , . move A and < > move B by a row; Escape takes cursors away.")));
  }
  if (data.circuit) root.append(circuitOf(data.circuit, shown, area));
  for (const table of data.tables ?? []) if (table.rows.length > 0) root.append(wordTable(table));
  for (const { heading, text } of data.texts ?? []) {
    root.append(element("details", { open: true }, element("summary", {}, heading), element("pre", {}, text)));
  }
  // On paper it is light.
  let theme = null;
  const themeOf = (name) => {
    if (name === undefined) delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = name;
    shown?.repaint();
    spectrum?.repaint();
  };
  addEventListener("beforeprint", () => { theme = document.documentElement.dataset.theme; themeOf("light"); });
  addEventListener("afterprint", () => themeOf(theme));
  return shown;
}
