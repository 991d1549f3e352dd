// What charts show as a drawing in SVG.

/** What charts show, each under its heading, as a drawing in SVG: panels, and below them who conducts when. */
function drawing(charts) {
  const labels = ([shown]) => [...shown.state.plots.flatMap((plot) => plot.axes[1]._values), ...shown.strips.map((strip) => strip.name)];
  const longest = Math.max(...charts.flatMap(labels).map((label) => label?.length ?? 0));
  const width = 900, left = Math.max(90, 7 * longest + 14), right = 20, inner = width - left - right, room = 190;
  const clean = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const parts = [];
  let base = 0, panelsSoFar = 0;
  /** Names beside their strokes, in as many lines as they take. */
  function names(all) {
    let column = left;
    for (const [name, colour, dash] of all) {
      const needs = 8 * name.length + 44;
      if (column > left && column + needs > width) [column, base] = [left, base + 16];
      parts.push(`<path d="M${column} ${base - 10}h24" stroke="${colour}" stroke-width="2" stroke-dasharray="${dash.join(" ")}"/>`);
      parts.push(`<text x="${column + 30}" y="${base - 6}" fill="${colour}">${clean(name)}</text>`);
      column += needs;
    }
  }
  for (const [shown, heading] of charts) {
    const { axis, panels, state } = shown;
    const [from, to] = state.view;
    const across = (x) => left + inner * (axis.log ? Math.log(x / from) / Math.log(to / from) : (x - from) / (to - from));
    parts.push(`<text x="${left}" y="${base + 18}" font-size="15">${clean(heading)}</text>`);
    base += 40;
    const ink = "#222", visible = panels.flatMap((panel) => panel.curves).filter((curve) => curve.shown);
    if (shown.isMany) {
      names(shown.runs.map((run) => [run, visible.find((curve) => curve.run === run)]).filter(([, curve]) => curve).map(([run, curve]) => [run, shown.colour(curve, "light"), []]));
      base += 20;
    }
    panels.forEach((panel, k) => {
      const plot = state.plots[k], clip = `p${panelsSoFar++}`;
      const curves = panel.curves.filter((curve) => curve.shown);
      const entries = shown.entriesOf(panel).filter((entry) => entry.curves.some((curve) => curve.shown));
      names(entries.map(({ name, curves: [curve] }) => [name, shown.isMany ? ink : shown.colour(curve, "light"), shown.dash(curve)]));
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
          if (Number.isNaN(y)) { path += pen === "L" ? "h0" : ""; pen = "M"; }
          else { path += `${pen}${across(x).toFixed(2)} ${up(y).toFixed(2)}`; pen = "L"; }
        });
        layers.line += `<path d="${path}" fill="none" stroke="${colour}" stroke-width="1.5" stroke-linecap="round" stroke-dasharray="${dash.join(" ")}" data-signal="${clean(curve.name)}"/>`;
      }
      parts.push(`<clipPath id="${clip}"><rect x="${left}" y="${top}" width="${inner}" height="${room}"/></clipPath><g clip-path="url(#${clip})">${layers.inside}${layers.outline}${layers.line}</g>`);
      base += room + 50;
    });
    const timeAt = (x) => (axis.log ? from * (to / from) ** ((x - left) / inner) : from + ((to - from) * (x - left)) / inner);
    const isClose = (a, b) => across(b) - across(a) < LANES.period;
    if (shown.strips.length > 0 && state.run) {
      parts.push(`<text x="${left}" y="${base - 10}">${clean(state.run)}</text>`);
      base += LANES.row;
    }
    for (const strip of shown.strips) {
      const foot = base - 10;
      let known = "", pale = "", unknown = "";
      for (const { x, width: wide, height: high, isKnown, isPale } of laneBars(strip, { view: state.view, left, room: inner, position: across, timeAt, isClose }, 1)) {
        const bar = `M${x.toFixed(2)} ${foot}v${(-high).toFixed(2)}h${wide.toFixed(2)}V${foot}z`;
        if (!isKnown) unknown += bar;
        else if (isPale) pale += bar;
        else known += bar;
      }
      parts.push(`<text x="${left - 6}" y="${foot - 3}" text-anchor="end">${clean(strip.name)}</text><path d="M${left} ${foot}h${inner}" stroke="#ddd"/>`);
      parts.push(`<path d="${unknown}" fill="#ddd"/><path d="${pale}" fill="#7fb3d5" fill-opacity="${PALE}"/><path d="${known}" fill="#7fb3d5" data-strip="${clean(strip.name)}"/>`);
      base += LANES.row;
    }
    if (shown.strips.length > 0) base += 20;
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${base}" viewBox="0 0 ${width} ${base}" font-family="sans-serif" font-size="12">` +
    `<rect width="${width}" height="${base}" fill="#fff"/>${parts.join("")}</svg>`;
}
