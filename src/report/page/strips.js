// Who conducts when: a lane for each device, with bars where periods can be told apart and the share of time on where they cannot.

/** CSS pixels of a lane, its bar, and a period (a bar with the gap beside it) below which it is not told apart from the next. */
const LANES = { row: 20, bar: 14, period: 8 };
/** Periods closer than that are drawn as a share where as many changes at least follow each other. */
const FEWEST_CHANGES = 5;

/** Strips with their changes as columns, and of each the time on from the first change to every other. */
function stripsOf(strips) {
  return (strips ?? []).map((strip) => {
    const times = numbers(strip.times), states = strip.states.map(Boolean), sums = new Float64Array(times.length);
    for (let k = 1; k < times.length; k++) sums[k] = sums[k - 1] + (states[k - 1] ? times[k] - times[k - 1] : 0);
    return { ...strip, times, states, sums };
  });
}

/**
 * The lanes of strips of one run or of several: a strip for each name, `runs` (one without a name where there is but one), and `show(run)`, which
 * makes the strips those of a run; a device that does not change in it is not known.
 */
function lanesOf(all) {
  const runs = [...new Set(all.map((strip) => strip.run ?? ""))];
  const strips = [...new Map(all.map((strip) => [strip.name, { ...strip }])).values()];
  const unknown = { start: null, times: new Float64Array(0), states: [], sums: new Float64Array(0) };
  const show = (run) => {
    for (const strip of strips) Object.assign(strip, unknown, all.find((own) => own.name === strip.name && (own.run ?? "") === run));
  };
  return { runs, strips, show };
}

/** State of a strip's device at t: true, false, or null before anything is known. */
function stateAt(strip, t) {
  const changes = rowAfter(strip.times, t);
  return changes === 0 ? strip.start : strip.states[changes - 1];
}

const stateWords = (strip, on) => (on === null ? "not known" : on ? strip.on : strip.off);

/** Time on from the first change to t, negative before it; NaN where nothing is known. */
function onUntil({ times, states, sums, start }, t) {
  const changes = rowAfter(times, t);
  if (changes > 0) return sums[changes - 1] + (states[changes - 1] ? t - times[changes - 1] : 0);
  return start === null ? NaN : start ? t - (times[0] ?? 0) : 0;
}

/** The part of the time from a to b > a in which it is on. */
const shareOn = (strip, a, b) => (onUntil(strip, b) - onUntil(strip, a)) / (b - a);

/** The whole periods about [a, b] between two changes, as the numbers of their first and last: from where it turns on to where it does again. */
function periodsAbout({ times, states }, a, b, [first, last]) {
  let from = Math.min(Math.max(rowAfter(times, a) - 1, first), last - 1), to = Math.max(Math.min(rowAt(times, b), last), from + 1);
  if (from > first && !states[from]) from--;
  if (to < last && !states[to]) to++;
  return [from, to];
}

/** The share of time on in the whole periods about [a, b]: it has no pattern of where these lie beside pixels. */
function shareAbout(strip, a, b, changes) {
  const [from, to] = periodsAbout(strip, a, b, changes);
  return (strip.sums[to] - strip.sums[from]) / (strip.times[to] - strip.times[from]);
}

/**
 * What a lane shows from a to b: { from, to, on } between two changes, and { from, to, changes: [first, last] } where so many are so close that
 * only a share of time can be shown. `isClose(a, b)`: whether two changes are nearer than a period must be wide.
 */
function pieces(strip, [from, to], isClose) {
  const { times, states } = strip, all = [];
  // A few changes beyond what is seen tell whether those at its edges are close.
  const first = Math.max(0, rowAfter(times, from) - FEWEST_CHANGES), end = Math.min(times.length, rowAt(times, to) + FEWEST_CHANGES);
  if (first === 0) all.push({ from: Math.min(from, times[0] ?? from), to: times[0] ?? to, on: strip.start });
  for (let k = first; k < end;) {
    let last = k + 1;
    while (last + 1 < end && isClose(times[last - 1], times[last + 1])) last++;
    if (last - k >= FEWEST_CHANGES) {
      all.push({ from: times[k], to: times[last], changes: [k, last] });
      k = last;
    } else {
      all.push({ from: times[k], to: times[k + 1] ?? Math.max(to, times[k]), on: states[k] });
      k++;
    }
  }
  return all.filter((piece) => piece.to >= from && piece.from <= to && (piece.to > piece.from || piece.on));
}

const percent = (share) => (Number.isNaN(share) ? "not known" : `${Number((100 * share).toPrecision(4))} %`);

/** The piece of a lane at t, where what is seen stretches over `room` pixels. */
const pieceAt = (strip, t, view, isClose) => pieces(strip, view, isClose).findLast((piece) => piece.from <= t && t <= piece.to);

/** A strip at t in words, with the times of a bar or, of periods that are not told apart from a to b, their share on and frequency. */
function words(strip, t, [a, b], piece) {
  if (!piece) return strip.name;
  if (piece.changes) {
    const [from, to] = periodsAbout(strip, a, b, piece.changes), span = strip.times[to] - strip.times[from];
    const share = `${strip.name}: ${strip.on} ${percent((strip.sums[to] - strip.sums[from]) / span)} of the time`;
    return `${share}, ${quantity((to - from) / 2 / span, "Hz", 4)} (from ${quantity(strip.times[from], "s", 6)} to ${quantity(strip.times[to], "s", 6)})`;
  }
  if (piece.on === null) return `${strip.name}: not known`;
  return `${strip.name}: ${piece.on ? strip.on : strip.off} from ${quantity(piece.from, "s", 9)} for ${quantity(piece.to - piece.from, "s", 6)}`;
}

/**
 * The bars of a lane as { x, width, height, isKnown, isPale }, their feet on one line: `left` to `left + room` is the view, `position(t)` where t
 * stands, `timeAt(x)` the reverse. A share of time goes from one `pixel` to the next, as seams would be seen between parts of one.
 */
function* laneBars(strip, { view, left, room, position, timeAt, isClose }, pixel) {
  const within = (x) => Math.min(Math.max(x, left), left + room);
  for (const piece of pieces(strip, view, isClose)) {
    const x = within(position(piece.from)), end = within(position(piece.to));
    if (!piece.changes) {
      if (piece.on !== false) yield { x, width: Math.max(end - x, 0.5), height: LANES.bar, isKnown: piece.on !== null };
      continue;
    }
    yield { x, width: end - x, height: LANES.bar, isKnown: true, isPale: true };
    for (let k = Math.round(x / pixel); k * pixel < end; k++) {
      const share = shareAbout(strip, timeAt(k * pixel), timeAt((k + 1) * pixel), piece.changes);
      yield { x: k * pixel, width: pixel, height: LANES.bar * share, isKnown: true };
    }
  }
}

/** Draws lanes on a canvas, `across` as in `laneBars`, and marks over all of them. */
function drawLanes(canvas, strips, across, marks) {
  const { width, left, room, position } = across;
  const height = strips.length * LANES.row + 6, ratio = devicePixelRatio || 1;
  Object.assign(canvas, { width: width * ratio, height: height * ratio });
  Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
  const ctx = canvas.getContext("2d"), [bar, grid, ink] = ["--bar", "--grid", "--ink"].map(themed);
  ctx.scale(ratio, ratio);
  ctx.font = "11px system-ui, sans-serif";
  ctx.textBaseline = "middle";
  ctx.textAlign = "right";
  strips.forEach((strip, k) => {
    const foot = k * LANES.row + 5 + LANES.bar;
    ctx.fillStyle = ink;
    ctx.fillText(strip.name, left - 6, foot - LANES.bar / 2, left - 8);
    ctx.fillStyle = grid;
    ctx.fillRect(left, foot - 1, room, 1);
    for (const { x, width: wide, height: high, isKnown, isPale } of laneBars(strip, across, 1 / ratio)) {
      ctx.fillStyle = isKnown ? bar : grid;
      ctx.globalAlpha = isPale ? PALE : 1;
      ctx.fillRect(x, foot - high, wide, high);
    }
    ctx.globalAlpha = 1;
  });
  for (const [t, colour] of marks) {
    ctx.fillStyle = colour;
    ctx.fillRect(Math.round(position(t)), 0, 1, height);
  }
}
