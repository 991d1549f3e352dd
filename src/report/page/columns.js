// Columns of numbers and what is asked of them: rows by time, values between rows, bounds over any span.

/** Rows a block: of each the lowest and highest value are kept. */
const BLOCK = 64;

/** Numbers from base64 of little-endian doubles, or from an array. */
function numbers(source) {
  if (typeof source !== "string") return Float64Array.from(source);
  if (Uint8Array.fromBase64) return new Float64Array(Uint8Array.fromBase64(source).buffer);
  const text = atob(source);
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = text.charCodeAt(k);
  return new Float64Array(bytes.buffer);
}

/** A curve: y over nondecreasing x, with bounds by block; NaN is a gap. Of one that is `partial` only some rows are there. */
function curveOf(name, x, y) {
  const blocks = Math.ceil(y.length / BLOCK);
  const lows = new Float64Array(blocks).fill(Infinity);
  const highs = new Float64Array(blocks).fill(-Infinity);
  for (let k = 0; k < y.length; k++) {
    const block = (k / BLOCK) | 0;
    if (y[k] < lows[block]) lows[block] = y[k];
    if (y[k] > highs[block]) highs[block] = y[k];
  }
  return { name, x, y, lows, highs, shown: true, partial: false };
}

/** The first row from `from` on that is at t or later. */
function rowAt(x, t, from = 0) {
  let low = from, high = x.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (x[middle] < t) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The first row later than t. */
function rowAfter(x, t) {
  let low = 0, high = x.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (x[middle] <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The row whose x is nearest to t. */
function nearestRow(x, t) {
  const after = Math.min(rowAt(x, t), x.length - 1);
  return after > 0 && t - x[after - 1] < x[after] - t ? after - 1 : after;
}

/** The value at t: of a row there the last one (after a jump), between rows a straight line; NaN outside and where rows are missing. */
function valueAt(curve, t) {
  const { x, y } = curve;
  const after = rowAfter(x, t);
  if (after === 0) return NaN;
  if (x[after - 1] === t) return y[after - 1];
  if (after === x.length || curve.partial) return NaN;
  const part = (t - x[after - 1]) / (x[after] - x[after - 1]);
  return y[after - 1] + part * (y[after] - y[after - 1]);
}

/** Lowest and highest value of the rows from `from` up to but not at `to`. */
function extremes(curve, from, to) {
  let low = Infinity, high = -Infinity;
  const take = (a, b) => {
    for (let k = a; k < b; k++) {
      if (curve.y[k] < low) low = curve.y[k];
      if (curve.y[k] > high) high = curve.y[k];
    }
  };
  const first = Math.ceil(from / BLOCK), last = Math.floor(to / BLOCK);
  if (first >= last) {
    take(from, to);
  } else {
    take(from, first * BLOCK);
    for (let block = first; block < last; block++) {
      low = Math.min(low, curve.lows[block]);
      high = Math.max(high, curve.highs[block]);
    }
    take(last * BLOCK, to);
  }
  return [low, high];
}

/** Bounds of what is seen of the curve in [from, to]. */
function boundsIn(curve, from, to) {
  const a = rowAt(curve.x, from), b = rowAfter(curve.x, to);
  let [low, high] = extremes(curve, a, b);
  for (const y of [valueAt(curve, from), valueAt(curve, to)]) {
    low = Math.min(low, Number.isNaN(y) ? low : y);
    high = Math.max(high, Number.isNaN(y) ? high : y);
  }
  return [low, high];
}

/** Mean and root mean square of the curve from a to b > a, straight between rows; NaN where rows are missing. */
function averagesOf(curve, a, b) {
  const { x, y } = curve;
  if (curve.partial || !(a >= x[0] && b <= x[x.length - 1])) return [NaN, NaN];
  let t = a, from = valueAt(curve, a), sum = 0, squares = 0;
  const on = (end, to) => {
    sum += ((end - t) * (from + to)) / 2;
    squares += ((end - t) * (from * from + from * to + to * to)) / 3;
    [t, from] = [end, to];
  };
  const last = rowAt(x, b);
  for (let k = rowAfter(x, a); k < last; k++) on(x[k], y[k]);
  // At b what comes before a jump there.
  on(b, x[last] === b || last === 0 ? y[last] : from + ((b - t) / (x[last] - t)) * (y[last] - from));
  return [sum / (b - a), Math.sqrt(squares / (b - a))];
}

/** The rows of what is seen of the curve, with one more on either side: from the first up to but not at the second. */
const rowsIn = (curve, [from, to]) => [Math.max(0, rowAt(curve.x, from) - 1), Math.min(curve.x.length, rowAfter(curve.x, to) + 1)];

/** Whether there are more than four rows a pixel: then a curve is drawn by its envelope. */
function isDense(curve, view, pixels) {
  const [a, end] = rowsIn(curve, view);
  return end - a > 4 * pixels;
}

/** Hands on the lowest and highest value of each pixel: of its rows, and of the lines that lead to it and on from it. */
function bars(curve, view, pixels, edge, bar) {
  const { x, y } = curve;
  let [a, end] = rowsIn(curve, view), before = NaN;
  for (let pixel = 0; pixel < pixels && a < end; pixel++) {
    const right = edge(pixel);
    const b = pixel + 1 === pixels ? end : Math.min(rowAt(x, right, a), end);
    let [low, high] = extremes(curve, a, b);
    // Where the line to the next row leaves the pixel.
    const part = b > 0 && b < end ? (right - x[b - 1]) / (x[b] - x[b - 1]) : NaN;
    const after = part >= 0 && part <= 1 ? y[b - 1] + part * (y[b] - y[b - 1]) : NaN;
    for (const y of [before, after]) {
      if (y < low) low = y;
      if (y > high) high = y;
    }
    if (low <= high) bar(pixel, low, high);
    before = b > a && Number.isNaN(after) ? y[b - 1] : after;
    a = b;
  }
}

/** Of each place the least of the values up to `reach` places away; a place without a value stays so. */
function least(values, reach) {
  return values.map((own, k) => {
    for (let j = Math.max(0, k - reach); j <= k + reach; j++) if (values[j] < own) own = values[j];
    return own;
  });
}

const negated = (values) => values.map((value) => -value);

/**
 * How often what lies between tops and floors (which are negative) goes up or down around each pixel: its way over its height, in as many pixels
 * as `reach` to either side has.
 */
function turnsIn(tops, floors, reach, line) {
  const highest = least(tops, reach), lowest = least(floors, reach), ways = [0];
  let before = NaN;
  tops.forEach((top, k) => {
    const middle = (top - floors[k]) / 2;
    ways.push(ways[k] + (Math.max(-floors[k] - top - line, Math.abs(middle - before)) || 0));
    before = middle;
  });
  return Array.from(tops, (_, k) => {
    const from = Math.max(0, k - reach), to = Math.min(tops.length, k + reach + 1);
    return ((ways[to] - ways[from]) / (-lowest[k] - highest[k])) * ((2 * reach + 1) / (to - from));
  });
}

/** Heights without the gaps that are narrower than twice the reach. Beyond either end they go on as they are there. */
function closed(heights, reach) {
  const pad = 2 * reach, all = new Float64Array(heights.length + 2 * pad).fill(heights[0]);
  all.fill(heights[heights.length - 1], pad).set(heights, pad);
  return negated(least(negated(least(all, reach)), reach)).subarray(pad, pad + heights.length);
}

/**
 * The envelope of what is seen of a dense curve: of each pixel that has a part of it [pixel, top, bottom, inner top, inner bottom, straight], where
 * what lies a line's width inside is inner; without any the last two heights are equal. `edge(k)` is the x at which pixel k of `pixels` ends,
 * `ends` gives the heights of two values, which grow downwards. Where edges are so close that some pixels have one and some have none (about two
 * in five pixels), gaps between them are part of it: they would make a pattern that is not there. Whether they are is asked of a wide stretch, over
 * which the places of edges in their pixels go round, and answered as before where it is close: else it would be now one, now the other.
 */
function envelope(curve, view, pixels, edge, ends, line) {
  let tops = new Float64Array(pixels).fill(NaN), floors = tops.slice();
  bars(curve, view, pixels, edge, (pixel, low, high) => {
    const [a, b] = ends(low, high), top = Math.min(a, b), bottom = Math.max(a, b), room = Math.max(line - (bottom - top), 0) / 2;
    tops[pixel] = top - room;
    floors[pixel] = -bottom - room;
  });
  const [near, far] = [8, 64].map((reach) => Math.round(reach * line));
  const turns = turnsIn(tops, floors, near, line);
  let isFull = false;
  const full = turnsIn(tops, floors, far, line).map((many) => (isFull = many > (isFull ? 1.1 : 1.25) * far));
  const filled = (heights) => closed(heights, Math.round(1.5 * line)).map((height, k) => (full[k] ? height : heights[k]));
  [tops, floors] = [filled(tops), filled(floors)];
  const [innerTops, innerFloors] = [tops, floors].map((heights) => negated(least(negated(heights), Math.round(line / 2))));
  const all = [];
  tops.forEach((top, pixel) => {
    if (Number.isNaN(top)) return;
    const from = innerTops[pixel] + line, to = -innerFloors[pixel] - line;
    all.push([pixel, top, -floors[pixel], ...(from < to ? [from, to] : [top, top]), turns[pixel] < 1.2]);
  });
  return all;
}

/** Whether a line of dashes has a gap this far from its start. */
function isDashGap(dash, at) {
  at %= dash.reduce((sum, part) => sum + part, 0);
  let k = 0;
  while (at >= dash[k]) at -= dash[k++];
  return k % 2 === 1;
}

/** The least and the greatest size of values from low to high, for a logarithmic axis. */
const sizesOf = (low, high) => [low < 0 && high > 0 ? 0 : Math.min(Math.abs(low), Math.abs(high)), Math.max(-low, high)].map((size) => Math.max(size, Number.MIN_VALUE));

/** Hands on the points of what is seen of the curve. */
function trace(curve, view, point) {
  const [from, to] = rowsIn(curve, view);
  for (let k = from; k < to; k++) point(curve.x[k], curve.y[k]);
}

const PREFIXES = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"];

/** The power of a thousand for a size, from −5 to 4; 0 of what is less, which has an exponent. */
function thousands(size) {
  if (!(size >= 1e-15) || !Number.isFinite(size)) return 0;
  return Math.min(4, Math.floor(Math.log10(size * (1 + 1e-12)) / 3));
}

/** A quantity with an SI prefix, to so many digits. */
function quantity(value, unit, digits = 6) {
  if (Number.isNaN(value)) return "–";
  if (unit === "" || unit === "dB" || unit === "°") return `${Number(value.toPrecision(digits))} ${unit}`.trim();
  const power = thousands(Math.abs(value));
  return `${Number((value / 1000 ** power).toPrecision(digits))} ${PREFIXES[power + 5]}${unit}`;
}

/** Labels of ticks under one prefix, with the decimals that tell them apart. */
function ticks(splits, unit) {
  if (unit === "") return splits.map((value) => (value == null ? null : (value !== 0 && Math.abs(value) < 1e-2 ? value.toExponential() : Number(value.toPrecision(6)).toString())));
  const known = splits.filter((value) => value != null);
  const size = Math.max(...known.map(Math.abs));
  const power = unit === "dB" || unit === "°" ? 0 : thousands(size);
  const exponent = size > 0 && size < 1e-15 ? Math.floor(Math.log10(size)) : 0;
  const scale = 1000 ** power * 10 ** exponent;
  const step = known.length > 1 ? Math.abs(known[1] - known[0]) / scale : 1;
  let decimals = 0;
  while (decimals < 12 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6) decimals++;
  const label = (value) => `${Number((value / scale).toFixed(decimals))}${exponent && value ? `e${exponent}` : ""} ${PREFIXES[power + 5]}${unit}`;
  return splits.map((value) => (value == null ? null : label(value).trim()));
}

/** From low to high the multiples of a step, which is not less than `least`: one of those given, beyond them 1, 2, 2.5 or 5 times a power of ten. */
function evenSplits(low, high, least, steps = []) {
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [...(least < steps[0] ? [] : steps), power, 2 * power, 2.5 * power, 5 * power, 10 * power].find((step) => step >= least);
  const first = Math.ceil(low / step), last = Math.floor(high / step);
  return Array.from({ length: last - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(15)));
}

/** Where a logarithmic axis with room for so many labels has lines: at powers of ten, 2 to 9 times them if that is not too much, or in even steps within one. */
function logSplits(low, high, room) {
  const decades = Math.log10(high / low);
  if (decades < 1) return evenSplits(low, high, (high - low) / 6);
  const all = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const times of room < 1.5 * decades ? [1] : [1, 2, 3, 4, 5, 6, 7, 8, 9]) {
      const value = Number(`${times}e${power}`);
      if (value >= low * (1 - 1e-12) && value <= high * (1 + 1e-12)) all.push(value);
    }
  }
  return all;
}

/** Which of them have labels where there is room for so many; the others are null. */
function logLabels(splits, room) {
  const digit = (value) => Math.round(value / 10 ** Math.floor(Math.log10(value) + 1e-9));
  const power = (value) => Math.floor(Math.log10(value) + 1e-9);
  const decades = Math.log10(splits[splits.length - 1] / splits[0]);
  if (!(decades >= 0.9)) return splits;
  const chosen = decades * 3 <= room ? [1, 2, 5] : [1];
  const by = Math.max(1, Math.ceil(decades / room));
  return splits.map((value) => (chosen.includes(digit(value)) && power(value) % by === 0 ? value : null));
}
