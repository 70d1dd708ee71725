// Numbers as text.
"use strict";

const digits = (() => {
  // `count` significant digits, no exponent where avoidable.
  function of(value, count = 4) {
    if (value === null || value === undefined || Number.isNaN(value)) return "—";
    if (!Number.isFinite(value)) return value < 0 ? "−∞" : "∞";
    const size = Math.abs(value);
    const text = size === 0 ? "0" : size >= 1e-3 && size < 1e5 ? Number(size.toPrecision(count)).toFixed(Math.max(0, count - 1 - Math.floor(Math.log10(size)))) : size.toExponential(count - 1).replace("e+", "e");
    return (value < 0 && size > 0 ? "−" : "") + text;
  }

  return { of, short: (value) => of(Number(value.toPrecision(3)), 3).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, ""), signed: (value, count) => (value > 0 ? "+" : "") + of(value, count) };
})();
