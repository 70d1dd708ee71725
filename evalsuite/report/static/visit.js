// What the pages of a report tell each other for as long as the tab lives: the overview's order and where one came from.
"use strict";

const visit = (() => {
  const key = `evalsuite ${new URL(document.documentElement.dataset.root || ".", location.href).pathname}`;
  return {
    // A browser may forbid storage to pages from disk; then the report's own order stands.
    read() {
      try { return JSON.parse(sessionStorage.getItem(key)) ?? {}; } catch { return {}; }
    },
    write(changes) {
      try { sessionStorage.setItem(key, JSON.stringify({ ...visit.read(), ...changes })); } catch { /* as above */ }
    },
  };
})();
