// How things look: colours and dashes of curves, and elements of the page.

/** Colours that stay apart for colour-blind readers (Okabe and Ito 2008), for light and dark paper. */
const COLOURS = {
  light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5a5a5a", "#8c564b"],
  dark: ["#4aa8e8", "#ff8a3d", "#2fc79b", "#e79bc5", "#9ad4f7", "#ffc24d", "#b4b4b4", "#c99a8c"],
};
/** Scales for many runs in order, from Matplotlib's plasma and viridis (van der Walt and Smith 2015) as far as they are seen on the paper. */
const SCALES = {
  light: ["#0d0887", "#5402a3", "#8b0aa5", "#b93289", "#db5c68", "#f48849"],
  dark: ["#2a788e", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"],
};
const DASHES = [[], [7, 3], [2, 2.5], [9, 3, 2, 3]];

/** An element with attributes and children; text is never markup. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value != null) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** What the style sheet says of a colour. */
const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Whether the paper is dark. */
const isDark = () => themed("--dark") === "1";

/** A stretch of a line as a background: its colour, and its dashes in pixels. */
function swatch(colour, dash) {
  let at = 0;
  const parts = dash.map((length, k) => `${k % 2 ? "transparent" : colour} ${at}px ${(at += length)}px`);
  return parts.length === 0 ? colour : `repeating-linear-gradient(90deg, ${parts.join(", ")})`;
}

/** The colour at a part from 0 to 1 of a scale, straight between its stops. */
function along(scale, part) {
  const at = part * (scale.length - 1), k = Math.min(Math.floor(at), scale.length - 2);
  const mixed = [1, 3, 5].map((c) => {
    const [one, other] = [scale[k], scale[k + 1]].map((stop) => Number.parseInt(stop.slice(c, c + 2), 16));
    return Math.round(one + (at - k) * (other - one)).toString(16).padStart(2, "0");
  });
  return `#${mixed.join("")}`;
}
