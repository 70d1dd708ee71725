// What a page shows, kept in the address so that a view can be shared: index.html#?metric=flip&target=path.
"use strict";

const view = (() => {
  const listeners = [];
  const overview = !document.documentElement.dataset.root; // a cell's view is in its address alone
  const ours = () => location.hash.startsWith("#?");
  // Coming back from a cell the address is bare: then what was left stands.
  let now = new URLSearchParams(ours() ? location.hash.slice(2) : location.hash || !overview ? "" : visit.read().view ?? "");

  function put() {
    const text = String(now);
    if (overview) visit.write({ view: text });
    const address = location.href.split("#")[0] + (text ? `#?${text}` : "");
    try { history.replaceState(null, "", address); } catch { location.replace(address); }
  }

  function tell(keys) {
    for (const [wanted, call] of listeners) if (!keys || !wanted || keys.some((key) => wanted.includes(key))) call();
  }

  window.addEventListener("hashchange", () => {
    if (!ours() && (overview || location.hash)) return;
    now = new URLSearchParams(location.hash.slice(2));
    if (overview) visit.write({ view: String(now) });
    tell();
  });

  return {
    get: (key) => now.get(key) ?? "",
    // What is "" is as the report has it, and leaves the address.
    set(changes) {
      const changed = Object.keys(changes).filter((key) => (now.get(key) ?? "") !== String(changes[key] ?? ""));
      if (!changed.length) return;
      for (const key of changed) if (changes[key]) now.set(key, changes[key]); else now.delete(key);
      put();
      tell(changed);
    },
    all: () => String(now),
    // Call when one of these keys, of null any, changes.
    on: (keys, call) => { listeners.push([keys, call]); },
    remember: () => visit.write({ view: String(now) }),
  };
})();
