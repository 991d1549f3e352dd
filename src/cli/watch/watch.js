// Loads the page anew when there is another version of it, and shows the same part of it.
(() => {
  const kept = sessionStorage.getItem("circ");
  if (kept) window.circ?.restore(JSON.parse(kept));
  const look = async () => {
    try {
      const version = await (await fetch("/version")).text();
      if (version !== "VERSION") {
        if (window.circ) sessionStorage.setItem("circ", JSON.stringify(window.circ.keep()));
        location.reload();
        return;
      }
    } catch {
      // Nobody answers: it may come back.
    }
    setTimeout(look, 300);
  };
  look();
})();
