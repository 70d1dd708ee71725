"""Words for LaTeX, and a document around a figure."""

from __future__ import annotations

import unicodedata

_SIGNS = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "_": r"\_", "%": r"\%",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}",
    '"': "{''}", "−": "$-$", "≈": r"$\approx$", "∞": r"$\infty$", "—": "---", "–": "--", "…": r"\ldots{}",
    "×": r"$\times$", "·": r"$\cdot$", "°": r"$^\circ$", "½": r"$\frac12$", "±": r"$\pm$",
    "µ": r"$\mu$", "√": r"$\surd$", "→": r"$\to$", "≤": r"$\leq$", "≥": r"$\geq$", "∕": "/",
    "\N{NO-BREAK SPACE}": "~", "`": r"\textasciigrave{}", "'": r"\textquotesingle{}",
} | {chr(code): f"$\\{name}$" for code, name in zip(
    (*range(0x3B1, 0x3BF), *range(0x3C0, 0x3C2), *range(0x3C3, 0x3CA)),
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi omega".split(),
    strict=True)}  # fmt: skip


def escape(text: str) -> str:
    """Text as LaTeX prints it with no package; characters without a LaTeX name become their code (U+4E2D). In one pass, so that
    what is put in is not escaped again."""
    return "".join(_SIGNS.get(c) or _moved(c) or (c if _typeset(c) else rf"\texttt{{U+{ord(c):04X}}}") for c in text)


def _moved(character: str) -> str | None:
    """A raised or lowered digit or sign, or None."""
    kind, _, code = unicodedata.decomposition(character).partition(" ")
    if kind not in ("<super>", "<sub>"):
        return None
    plain = chr(int(code, 16))
    return f"${'^' if kind == '<super>' else '_'}{{{'-' if plain == '−' else plain}}}$"


def _typeset(character: str) -> bool:
    """Whether LaTeX's own fonts have it: ASCII, and Latin letters with an accent."""
    accented = character < "ſ" and len(unicodedata.decomposition(character).split()) == 2
    return accented or (character.isascii() and character.isprintable())


def standalone(name: str, words: str, inches: float) -> str:
    """A document that shows NAME.tex, which lies beside it, with words beneath: `pdflatex standalone.tex`. inches: its width."""
    return "\n".join([
        r"\documentclass[varwidth=50cm, border=2mm]{standalone}",
        r"\usepackage[utf8]{inputenc}",
        r"\usepackage{booktabs, calc, graphicx, tikz}",
        r"\begin{document}",
        rf"\input{{{name}.tex}}",
        "",
        rf"\begin{{minipage}}{{{inches:.2f}in}}\footnotesize {escape(words)}\end{{minipage}}" if words else "",
        r"\end{document}",
        "",
    ])  # fmt: skip
