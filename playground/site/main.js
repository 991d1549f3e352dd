// After the last keystroke, ms; and the longest that a run may take, ms.
const PAUSE = 250;
const PATIENCE = 20_000;

const $ = (id) => document.getElementById(id);
const text = $("text");
let worker, timer, watch, newest = 0, busy = false;
// The circuit of the latest netlist, and the chart of its run.
let circuit = null, shown = null;

// A worker that is still at an old netlist is ended: nothing else stops a run.
function start() {
  worker?.terminate();
  busy = false;
  worker = new Worker("worker.js", { type: "module" });
  worker.onmessage = ({ data }) => take(data);
  worker.onerror = (event) => fail(`the simulator stopped: ${event.message}`);
}

function fail(message) {
  clearTimeout(watch);
  start();
  $("state").textContent = message;
}

function ask() {
  if (busy) start();
  busy = true;
  newest += 1;
  $("state").textContent = "running";
  $("right").classList.add("stale");
  worker.postMessage({ id: newest, netlist: text.value });
  clearTimeout(watch);
  watch = setTimeout(() => fail("stopped: the run takes too long for this page"), PATIENCE);
}

function take({ id, checked, ran, failure }) {
  if (failure) return fail(failure);
  if (id !== newest) return;
  if (checked) {
    list(checked.findings);
    circuit = checked.schematic;
    if (!checked.runs && circuit) show({ title: checked.title, axis: { name: "time" }, columns: [], panels: [] });
  }
  if (ran) {
    list([...($("findings").of ?? []), ...ran.findings]);
    if (ran.page) show(ran.page);
  }
  if (ran || !checked.runs) {
    busy = false;
    clearTimeout(watch);
    $("right").classList.toggle("stale", !ran);
    const wrong = $("findings").of.some((f) => f.severity === "error");
    $("state").textContent = wrong ? "refused" : ran ? "done" : "nothing to run: there is no .tran";
  }
}

// A result with its circuit; what a reader chose to see stays.
function show(page) {
  const kept = shown?.keep();
  shown?.remove();
  window.circ = shown = circPage($("right"), { ...page, circuit });
  if (shown && kept) shown.restore(kept);
}

// Findings below the editor, and underlined in it.
function list(findings) {
  $("findings").of = findings;
  $("findings").replaceChildren(...findings.map((f) => {
    const item = document.createElement("li");
    item.className = f.severity;
    item.textContent = (f.line ? `${f.line}: ` : "") + f.message;
    const more = document.createElement("small");
    more.textContent = [f.label, f.help].filter(Boolean).join("; ");
    item.append(more);
    item.onclick = () => { text.focus(); text.setSelectionRange(f.start ?? 0, f.end ?? 0); };
    return item;
  }));
  underline(findings);
}

function underline(findings) {
  const marks = findings.filter((f) => f.start != null && f.end > f.start).sort((a, b) => a.start - b.start);
  const parts = [];
  let at = 0;
  for (const { start, end, severity } of marks) {
    if (start < at) continue;
    parts.push(text.value.slice(at, start));
    const mark = document.createElement("span");
    mark.className = severity;
    mark.textContent = text.value.slice(start, end);
    parts.push(mark);
    at = end;
  }
  // The last line needs something on it to have a height.
  $("marks").replaceChildren(...parts, text.value.slice(at) + "\n ");
  scrolled();
}

function scrolled() {
  $("marks").scrollTop = text.scrollTop;
  $("marks").scrollLeft = text.scrollLeft;
}

// The circuit stands in the address, so that a link holds it.
const packed = (netlist) => {
  const bytes = new TextEncoder().encode(netlist);
  return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
};
const unpacked = (fragment) => {
  const letters = atob(fragment.replace(/-/g, "+").replace(/_/g, "/"));
  return new TextDecoder().decode(Uint8Array.from(letters, (c) => c.charCodeAt(0)));
};

function put(netlist) {
  text.value = netlist;
  underline([]);
  remember();
  ask();
}

function remember() {
  history.replaceState(null, "", "#" + packed(text.value));
}

function fromAddress() {
  try {
    return location.hash.length > 1 ? unpacked(location.hash.slice(1)) : null;
  } catch {
    $("state").textContent = "the link is damaged";
    return null;
  }
}

text.oninput = () => {
  underline([]);
  clearTimeout(timer);
  timer = setTimeout(() => { remember(); ask(); }, PAUSE);
};
text.onscroll = scrolled;
window.onhashchange = () => {
  const netlist = fromAddress();
  if (netlist !== null && netlist !== text.value) put(netlist);
};

const examples = await (await fetch("examples.json")).json();
for (const { name, title } of examples) $("examples").add(new Option(`${name}: ${title}`, name));
$("examples").onchange = (event) => {
  const chosen = examples.find((example) => example.name === event.target.value);
  if (chosen) put(chosen.netlist);
};
start();
put(fromAddress() ?? examples.find((example) => example.name === "buck").netlist);
