// The page: headline, controls, charts, tables and text of one result.

/** Rows of a table that are written at once; the rest on request. */
const ROWS = 500;
/** CSS pixels that charts are wide when they are printed, about a sheet of A4 or Letter within its margins; the style sheet fits them to others. */
const PAPER = 700;

/** Panels of curves over the columns of the data; curves whose columns follow later are drawn by their overviews until then. */
function panelsOf(data) {
  const columns = data.columns.map((column) => (column == null ? null : numbers(column)));
  const of = (curve) => {
    const { name, run } = curve;
    if (columns[curve.x] && columns[curve.y]) return { ...curveOf(name, columns[curve.x], columns[curve.y]), run };
    const [x, y] = curve.overview;
    return { ...curveOf(name, columns[x], columns[y]), run, partial: true, later: [curve.x, curve.y] };
  };
  return data.panels.map((panel) => ({ ...panel, curves: panel.curves.map(of) }));
}

/** The columns that stand behind the page are there: its curves get all their rows, one after the other, so that the page can be zoomed meanwhile. */
function circRest(shown) {
  const columns = new Map(), scripts = [...document.querySelectorAll("script[data-column]")];
  const steps = [
    ...scripts.map((script) => () => {
      columns.set(Number(script.dataset.column), numbers(script.textContent));
      script.remove();
    }),
    ...shown.completing(columns),
  ];
  const go = () => {
    steps.shift()?.();
    if (steps.length > 0) setTimeout(go);
  };
  setTimeout(go);
}

/** A table of words; long ones show their first rows and a button for the rest. */
function wordTable({ heading, run, header, rows, all }) {
  const body = element("tbody");
  const line = (cells) => element("tr", {}, ...cells.map((cell) => element("td", {}, cell)));
  body.append(...rows.slice(0, ROWS).map(line));
  const table = element("table", { class: "words" }, element("thead", {}, element("tr", {}, ...header.map((name) => element("th", { scope: "col" }, name)))), body);
  const scroll = element("div", { class: "scroll", role: "region", tabindex: 0, "aria-label": heading }, table);
  const section = element("details", { open: rows.length <= 40 }, element("summary", {}, `${heading}${run ? ` of ${run}` : ""} (${all > rows.length ? `the first ${rows.length} of ${all}` : rows.length})`), scroll);
  if (run) section.dataset.run = run;
  if (rows.length > ROWS) {
    const more = element("button", { type: "button", onclick: () => { body.append(...rows.slice(ROWS).map(line)); more.remove(); } }, `${rows.length} rows`);
    section.append(more);
  }
  return section;
}

/** The picture of the circuit, with what conducts at cursor A coloured. */
function circuitOf(svg, shown, area) {
  const picture = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement;
  const when = element("p", { class: "about" });
  const section = element("details", { open: true, class: "circuit" }, element("summary", {}, "Circuit"), when, document.importNode(picture, true));
  // A large one is not shrunk until nobody can read it: it can be moved.
  const drawn = section.querySelector("svg");
  drawn.setAttribute("role", "img");
  drawn.setAttribute("aria-label", `circuit diagram of ${drawn.querySelector("title")?.textContent ?? "the netlist"}`);
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

/** A choice, above the lanes, of the run whose lanes, circuit and events are shown; `act` shows those of one. Returns what shows those of the chosen one. */
function chooser(shown, area, runs, act) {
  const select = element("select", { onchange: () => chosen() }, ...runs.map((run) => element("option", { value: run }, run)));
  const chosen = () => {
    act(select.value);
    shown.anew(select.value);
  };
  area.querySelector(".panels").after(element("p", { class: "which" }, element("label", {}, "who conducts when, circuit and events: run ", select)));
  const { keep, restore } = shown;
  shown.keep = () => ({ ...keep(), run: select.value });
  shown.restore = (kept) => {
    restore(kept);
    if (runs.includes(kept.run)) select.value = kept.run;
    chosen();
  };
  return chosen;
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
  let shown = null, spectrum = null, choose = null;
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
    const wasHidden = spectrumArea.hidden;
    spectrumArea.hidden = false;
    if (spectrumArea.childElementCount === 0) {
      const bar = element("div", { class: "controls", role: "toolbar", "aria-label": "axes of the spectrum" });
      axes(bar, () => spectrum, spectrumLooks);
      spectrumArea.append(element("h2", {}, "Spectrum of what is seen"), spectrumWords, bar, element("div"));
    }
    spectrum = chart(spectrumArea.lastChild, { axis: { name: "frequency", unit: "Hz", log: spectrumLooks.x }, panels: of, strips: [] }, announce);
    if (spectrumLooks.y) spectrum.logarithmic(true);
    if (wasHidden) spectrumArea.scrollIntoView({ block: "nearest" });
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
    const lanes = lanesOf(stripsOf(data.strips));
    shown = chart(area, { axis: data.axis, panels, strips: lanes.strips }, announce);
    // Of several runs one has its lanes, circuit and events shown.
    const runs = [...new Set([...lanes.runs, ...(data.tables ?? []).filter((table) => table.rows.length > 0).map((table) => table.run ?? "")])].filter((run) => run !== "");
    if (runs.length > 0) choose = chooser(shown, area, runs, (run) => {
      lanes.show(run);
      for (const table of root.querySelectorAll("details[data-run]")) table.hidden = table.dataset.run !== run;
    });
    area.addEventListener("view", () => { if (spectrum && !spectrumArea.hidden) transformed(); });
    root.append(element("details", {}, element("summary", {}, "Keys and mouse"), element("p", {},
      "Drag: zoom to a span, a box or a height. Wheel: zoom at the pointer; with shift, move. Shift and drag: move. Double click or Home: all. Click: cursor A; shift and click: cursor B; a click on a name shows or hides its curve. " +
      "Keys: + − ← → Home; a, b place a cursor at the pointer (without one, in the middle); , . move A and < > move B by a row; Escape takes cursors away.")));
  }
  if (data.circuit) root.append(circuitOf(data.circuit, shown, area));
  for (const table of data.tables ?? []) if (table.rows.length > 0) root.append(wordTable(table));
  choose?.();
  for (const { heading, text } of data.texts ?? []) {
    root.append(element("details", { open: true }, element("summary", {}, heading), element("pre", {}, text)));
  }
  // On paper it is light, and charts are as wide as a sheet.
  let theme = null;
  const repainted = (name, width) => {
    if (name === undefined) delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = name;
    shown?.repaint(width);
    spectrum?.repaint(width);
  };
  addEventListener("beforeprint", () => { theme = document.documentElement.dataset.theme; repainted("light", PAPER); });
  addEventListener("afterprint", () => repainted(theme));
  return shown;
}
