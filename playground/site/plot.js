// Waveforms by unit: drag over a stretch of time to see it closer, double click to see all; a click on a name hides its curve.
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5a5a5a", "#8c564b"];
const DASHES = [[], [7, 3], [2, 2.5], [9, 3, 2, 3]];
const NAMES = { V: "voltage", A: "current" };
const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

let drawn = [];

function quantity(value, unit) {
  if (value == null) return "";
  if (value === 0) return `0 ${unit}`;
  const [factor, prefix] = PREFIXES.find(([f]) => Math.abs(value) >= f * 0.9999995) ?? PREFIXES.at(-1);
  return `${Number((value / factor).toPrecision(4))} ${prefix}${unit}`;
}

// Rows of all signals over one time; a value between the points of a signal lies on its line.
function joined(signals) {
  const tables = signals.map(({ t, y }) => [t, y]);
  return uPlot.join(tables);
}

export function show(place, signals) {
  drawn.forEach((plot) => plot.destroy());
  drawn = [];
  const units = [...new Set(signals.map((s) => s.unit))];
  const together = uPlot.sync("time");
  for (const unit of units) {
    const own = signals.filter((s) => s.unit === unit).map(distinct);
    const series = own.map((s, k) => ({
      label: s.name,
      stroke: COLOURS[k % COLOURS.length],
      dash: DASHES[Math.floor(k / COLOURS.length) % DASHES.length],
      width: 1.5,
      spanGaps: true,
      points: { show: false },
      value: (_, v) => quantity(v, unit),
    }));
    const axis = (name, u) => ({ label: name, size: 70, values: (_, ticks) => ticks.map((v) => quantity(v, u)) });
    drawn.push(new uPlot({
      width: Math.max(place.clientWidth, 300),
      height: 240,
      scales: { x: { time: false } },
      cursor: { sync: { key: together.key }, drag: { x: true, y: false } },
      series: [{ label: "time", value: (_, v) => quantity(v, "s") }, ...series],
      axes: [{ values: (_, ticks) => ticks.map((v) => quantity(v, "s")) }, axis(NAMES[unit] ?? "value", unit)],
    }, joined(own), place));
  }
}

// The second of two points of one time moves to the next double, as tables are joined by time.
function distinct({ t, y, ...rest }) {
  const times = [...t];
  for (let k = 1; k < times.length; k += 1) {
    if (times[k] <= times[k - 1]) times[k] = times[k - 1] + Math.max(Math.abs(times[k - 1]), 1e-300) * 2 ** -52;
  }
  return { ...rest, t: times, y };
}

window.addEventListener("resize", () => {
  for (const plot of drawn) plot.setSize({ width: Math.max(plot.root.parentNode.clientWidth, 300), height: 240 });
});
