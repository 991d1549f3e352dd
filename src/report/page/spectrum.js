// The spectrum of what is seen: amplitudes by fast Fourier transform of evenly spaced values under a Hann window.

/** The most values taken of a curve. */
const MOST_SAMPLES = 1 << 16;

/** The transform of 2^k complex numbers, in place (Cooley and Tukey 1965, radix 2). */
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j], re[i]];
      [im[i], im[j]] = [im[j], im[i]];
    }
  }
  for (let size = 2; size <= n; size *= 2) {
    const half = size / 2;
    for (let k = 0; k < half; k++) {
      const c = Math.cos((-2 * Math.PI * k) / size), s = Math.sin((-2 * Math.PI * k) / size);
      for (let at = k; at < n; at += size) {
        const other = at + half;
        const r = re[other] * c - im[other] * s, q = re[other] * s + im[other] * c;
        re[other] = re[at] - r;
        im[other] = im[at] - q;
        re[at] += r;
        im[at] += q;
      }
    }
  }
}

/** The longest time between rows in [from, to]. */
function widestGap(x, from, to) {
  let gap = 0;
  for (let k = Math.max(rowAt(x, from), 1), last = rowAfter(x, to); k < last; k++) gap = Math.max(gap, x[k] - x[k - 1]);
  return gap;
}

/**
 * Amplitudes of the curve in [from, to] over frequency, f > 0: of a sine in the span its peak value. Values between rows are straight lines;
 * the mean is taken away first, as the window would smear it.
 */
function spectrumOf(curve, from, to) {
  const rows = rowAfter(curve.x, to) - rowAt(curve.x, from);
  let n = 1024;
  while (n < 4 * rows && n < MOST_SAMPLES) n *= 2;
  const re = new Float64Array(n), im = new Float64Array(n);
  const inside = (t) => valueAt(curve, Math.min(Math.max(t, curve.x[0]), curve.x[curve.x.length - 1]));
  for (let k = 0; k < n; k++) re[k] = inside(from + ((to - from) * k) / n);
  const mean = re.reduce((sum, value) => sum + value, 0) / n;
  // A Hann window halves amplitudes.
  for (let k = 0; k < n; k++) re[k] = (re[k] - mean) * (1 - Math.cos((2 * Math.PI * k) / n));
  transform(re, im);
  const half = n / 2;
  const x = new Float64Array(half - 1), y = new Float64Array(half - 1);
  for (let k = 1; k < half; k++) {
    x[k - 1] = k / (to - from);
    y[k - 1] = (2 * Math.hypot(re[k], im[k])) / n;
  }
  return curveOf(curve.name, x, y);
}
