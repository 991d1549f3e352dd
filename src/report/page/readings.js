// The table of readings, and the legend of many runs.

/**
 * The table: each curve at the pointer, at both cursors, their difference, and over time mean and rms between them; of strips states, and the share
 * of time on. `shown` is the chart: { axis, panels, curves, strips, runs, isMany, state, colour, dash, unitOf, toggle, briefs, shareAt }.
 */
function readingsTable(shown) {
  const { axis, panels, curves, strips, runs, state } = shown;
  const columns = ["pointer", "a", "b"], isTime = axis.name === "time", averages = isTime ? ["mean", "rms"] : [];
  const all = [...columns, "delta", ...averages];
  const head = Object.fromEntries(all.map((name) => [name, element("th", { scope: "col", "data-at": name })]));
  const cells = new Map(), boxes = new Map();
  let spanned = null;
  const body = element("tbody");
  const row = (key, label) => {
    const own = Object.fromEntries(all.map((name) => [name, element("td", { "data-at": name })]));
    cells.set(key, own);
    body.append(element("tr", { "data-signal": key.name }, element("th", { scope: "row" }, label), ...Object.values(own)));
  };
  const groups = [];
  // Several curves at once: those of a run, those of a panel.
  const heading = (...all) => {
    const labels = all.map(([words, curves]) => {
      const box = element("input", { type: "checkbox", checked: true, onchange: () => { shown.toggle(curves, box.checked); tick(); } });
      groups.push([box, curves]);
      return element("label", {}, box, words);
    });
    body.append(element("tr", { class: "group" }, element("th", { scope: "rowgroup", colspan: all.length + 1 }, ...labels)));
  };
  if (runs.length > 1 && !shown.isMany) heading(...runs.map((run) => [run, curves.filter((curve) => curve.run === run)]));
  for (const panel of panels) {
    if (panels.length > 1) heading([panel.quantity, panel.curves]);
    for (const curve of panel.curves) {
      const box = element("input", { type: "checkbox", checked: true, onchange: () => { shown.toggle([curve], box.checked); tick(); } });
      boxes.set(curve, box);
      const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
      cells.set(swatch, curve);
      row(curve, element("label", {}, box, swatch, curve.name));
    }
  }
  for (const strip of strips) row(strip, strip.name);
  const table = element("table", {},
    element("caption", {}, "Readings"),
    element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "signal"), ...Object.values(head))), body);
  const put = (cell, value, words) => {
    cell.textContent = words;
    if (value === null) cell.removeAttribute("data-value");
    else cell.dataset.value = value;
  };
  function updateStrip(strip, own, times, isNew) {
    for (const name of columns) {
      const t = times[name], on = t === null ? null : stateAt(strip, t);
      // Where periods are too close to be told apart the state at the pointer would say nothing.
      const share = name === "pointer" && t !== null ? shown.shareAt(strip, t) : null;
      put(own[name], null, t === null ? "" : share !== null ? `${strip.on} ${percent(share)}` : stateWords(strip, on));
    }
    if (averages.length === 0 || !isNew) return;
    const { a, b } = times, share = a !== null && b !== null && a !== b ? shareOn(strip, Math.min(a, b), Math.max(a, b)) : null;
    put(own.mean, share, share === null ? "" : `${strip.on} ${percent(share)}`);
  }
  function update() {
    const { a, b } = state.cursors;
    const times = { pointer: state.pointer, a, b };
    const both = a !== null && b !== null;
    shown.briefs(times, both);
    for (const name of columns) {
      const label = name === "pointer" ? axis.name : name.toUpperCase();
      put(head[name], times[name], times[name] === null ? label : `${label} ${quantity(times[name], axis.unit, 9)}`);
    }
    const inverse = isTime && both && a !== b ? ` (${quantity(1 / Math.abs(b - a), "Hz")})` : "";
    put(head.delta, both ? b - a : null, both ? `B − A ${quantity(b - a, axis.unit, 9)}${inverse}` : "B − A");
    for (const name of averages) put(head[name], null, `${name} A…B`);
    const isNew = spanned !== `${a} ${b}`;
    spanned = `${a} ${b}`;
    for (const [key, own] of cells) {
      if (key instanceof HTMLElement) {
        key.style.background = swatch(shown.colour(own), shown.dash(own));
        continue;
      }
      if (key.states) {
        updateStrip(key, own, times, isNew);
        continue;
      }
      const values = columns.map((name) => (times[name] === null ? null : valueAt(key, times[name])));
      columns.forEach((name, k) => put(own[name], values[k], values[k] === null ? "" : quantity(values[k], shown.unitOf(key))));
      put(own.delta, both ? values[2] - values[1] : null, both ? quantity(values[2] - values[1], shown.unitOf(key)) : "");
      // These look at all rows between: not whenever the pointer moves.
      if (averages.length > 0 && (isNew || key.partial !== own.partial)) {
        const found = both && a !== b ? averagesOf(key, Math.min(a, b), Math.max(a, b)) : null;
        averages.forEach((name, k) => put(own[name], found && found[k], found ? quantity(found[k], shown.unitOf(key)) : ""));
        own.partial = key.partial;
      }
    }
  }
  function tick() {
    boxes.forEach((box, curve) => { box.checked = curve.shown; });
    for (const [box, some] of groups) {
      const visible = some.filter((curve) => curve.shown).length;
      box.checked = visible > 0;
      box.indeterminate = visible > 0 && visible < some.length;
    }
  }
  /** What was found between the cursors is found anew with the next update. */
  const renew = () => { spanned = null; };
  return { table, update, tick, renew };
}

/** Of many runs a list that scrolls and folds: a box shows and hides one, its name shows it alone, and all again. */
function runsLegend(shown) {
  const { runs, curves } = shown;
  const items = runs.map((run) => {
    const own = curves.filter((curve) => curve.run === run);
    const box = element("input", { type: "checkbox", checked: true, "aria-label": `show ${run}`, onchange: () => shown.toggle(own, box.checked) });
    const line = element("span", { class: "swatch", "aria-hidden": "true" });
    const name = element("button", { type: "button", title: "this run alone; once more: all", onclick: () => shown.isolate(own, curves) }, line, run);
    return { run, own, box, line, name };
  });
  const list = element("div", { class: "list", role: "group", "aria-label": "runs", tabindex: 0, style: `--run: calc(${Math.max(...runs.map((run) => run.length))}ch + 5.5em)` }, ...items.map(({ box, name }) => element("span", {}, box, name)));
  const legend = element("details", { class: "runs", open: true }, element("summary", {}, `${runs.length} runs`), list);
  function update() {
    for (const { own, box, line, name } of items) {
      const isShown = own.some((curve) => curve.shown);
      box.checked = isShown;
      name.setAttribute("aria-pressed", String(isShown));
      line.style.background = shown.colour(own[0]);
    }
  }
  return { legend, update };
}
