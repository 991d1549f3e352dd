// One netlist at a time, away from the page, so that typing never waits for a run.
import init, { check, run } from "./circ_playground.js";

const ready = init();

onmessage = async ({ data: { id, netlist } }) => {
  await ready;
  const checked = JSON.parse(check(netlist));
  postMessage({ id, checked });
  if (checked.runs) postMessage({ id, ran: JSON.parse(run(netlist)) });
};
ready.then(() => postMessage({ ready: true }), (error) => postMessage({ failure: String(error) }));
