"""Damaged copies of good files: bytes, words, and trees of values. The same seed gives the same damage."""

from __future__ import annotations

import copy
import json
import random
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence

#: Edges of the integer types, and sizes that no machine has.
INTEGERS = (0, 1, -1, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 999_999, 1_000_000, 2**24, 2**30, 2**31 - 1, -(2**31),
            2**32 - 1, 2**62, 2**63 - 1)  # fmt: skip
WORDS = ("", "0", "-0", "-1", "1e309", "-1e309", "nan", "inf", "-inf", "1e-320", "999999999999999999999999", "0x7fffffff", "%s%n",
         "null", "true", "../../../../etc/passwd", "/dev/zero", "..", ".", "a/b", "a\\b", "$x", "&#0;", "é\u202e\U0001f4a9", "\0",
         "x" * 5000, "1, 2", "1 2 3 4 5 6 7 8 9", "1000000", "-1000000", "18446744073709551616")  # fmt: skip
VALUES = (None, True, False, 0, -1, 1, 2**31, 2**70, 1e308, -1e308, 1e-320, float("nan"), float("inf"), "", "x", "../../../../x",
          "/etc/passwd", "nan", "\0", "é\u202e", "y" * 3000, [], {}, [None], [1], [[]], [1, 2, 3, 4], {"": 0}, {"value": "x"},
          ["../x"], {"type": []})  # fmt: skip

Mutator = Callable[[random.Random, bytes, Sequence[bytes]], bytes]


def mutated(mutator: Mutator, seed: int, corpus: Sequence[bytes]) -> bytes:
    """One of the corpus, damaged."""
    chance = random.Random(seed)
    return mutator(chance, chance.choice(corpus), corpus)


def data(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """One to six changes of bytes; half of them in the first 400, where headers are."""
    out = bytearray(good)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        reach = len(out) if chance.random() < 0.5 else min(len(out), 400)
        at = chance.randrange(max(reach, 1))
        kind = chance.randrange(9)
        if kind == 0 and out:
            out[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            run = chance.randrange(1, 16)
            out[at : at + run] = chance.randbytes(run)
        elif kind == 2:
            width, order = chance.choice((1, 2, 4, 4, 4, 8)), chance.choice(("little", "big"))
            value = chance.choice(INTEGERS) % (1 << 8 * width)
            out[at : at + width] = value.to_bytes(width, order)
        elif kind == 3:
            del out[at:]
        elif kind == 4:
            del out[at : at + chance.randrange(1, 64)]
        elif kind == 5:
            piece = out[at : at + chance.randrange(1, 256)]
            out[at:at] = piece * chance.choice((1, 1, 2, 20))
        elif kind == 6:
            other = chance.choice(corpus)
            out[at:] = other[chance.randrange(max(len(other), 1)) :]
        elif kind == 7:
            run = chance.randrange(1, 64)
            out[at : at + run] = bytes([chance.choice((0, 255, 32, 48, 57))]) * run
        else:
            out[at:at] = chance.randbytes(chance.randrange(1, 32))
    return bytes(out)


def text(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """One to four changes of words, or of bytes."""
    if chance.random() < 0.15:
        return data(chance, good, corpus)
    tokens = re.findall(r"\w+(?:\.\w+)?|\s+|.", good.decode("utf-8", "replace"), re.S)
    for _ in range(chance.choice((1, 1, 2, 4))):
        at = chance.randrange(max(len(tokens), 1))
        kind = chance.randrange(8)
        if kind == 0:
            del tokens[at : at + chance.randrange(1, 4)]
        elif kind == 1:
            tokens[at:at] = tokens[at : at + chance.randrange(1, 12)] * chance.choice((1, 2, 50))
        elif kind in (2, 3):
            numbers = [i for i, token in enumerate(tokens) if token[:1].isdigit()] if kind == 3 else []
            place = chance.choice(numbers) if numbers else at
            tokens[place : place + 1] = [chance.choice(WORDS)]
        elif kind == 4:
            del tokens[at:]
        elif kind == 5 and len(tokens) > 1:
            other = chance.randrange(len(tokens))
            tokens[at % len(tokens)], tokens[other] = tokens[other], tokens[at % len(tokens)]
        elif kind == 6:
            tokens.insert(at, chance.choice("()[]{}<>\"'&;=/\\#\n\t\0"))
        else:
            tokens.insert(at, chance.choice("([{<") * chance.choice((10, 500, 20000)))
        tokens = tokens or [" "]
    return "".join(tokens).encode("utf-8", "surrogatepass")


def _change(chance: random.Random, tree: object) -> object:
    """A tree of lists and dictionaries with one node replaced, removed, repeated, renamed or put elsewhere."""
    places = list(_places(tree))
    if not places:
        return chance.choice(VALUES)
    holder, key = chance.choice(places)
    kind = chance.randrange(6)
    if kind <= 2:
        holder[key] = copy.deepcopy(chance.choice(VALUES))
    elif kind == 3:
        del holder[key]
    elif kind == 4:
        other, elsewhere = chance.choice(places)
        holder[key] = copy.deepcopy(other[elsewhere])
    elif isinstance(holder, list):
        holder.append(copy.deepcopy(holder[key]))
    else:
        holder[chance.choice(("", "x", "../x", "schema", f"{key}2"))] = holder.pop(key)
    return tree


def _places(tree: object):
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield tree, key
        yield from _places(value)


def json_tree(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """Values of other types anywhere in a JSON file; sometimes its text."""
    if chance.random() < 0.15:
        return text(chance, good, corpus)
    tree = json.loads(good)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        tree = _change(chance, tree)
    if chance.random() < 0.02:
        return b'{"cells":' * 30_000
    return json.dumps(tree).encode()


def toml_tree(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """Values of other types anywhere in a TOML file; sometimes its text."""
    import tomllib

    if chance.random() < 0.3:
        return text(chance, good, corpus)
    tree = tomllib.loads(good.decode())
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        tree = _change(chance, tree)
    return _toml(tree).encode() if isinstance(tree, dict) else b"= 1"


def _toml(table: dict) -> str:
    return "".join(f"{json.dumps(str(key))} = {_inline(value)}\n" for key, value in table.items() if value is not None)


def _inline(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {_inline(v)}" for k, v in value.items() if v is not None) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_inline(v) for v in value if v is not None) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "")


def xml_tree(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """Elements removed, repeated, moved, nested; attributes removed, renamed, given other values; sometimes the text."""
    if chance.random() < 0.25:
        return text(chance, good, corpus)
    if chance.random() < 0.05:
        return chance.choice(TRAPS)
    root = ElementTree.fromstring(good)
    for _ in range(chance.choice((1, 1, 2, 4))):
        elements = [(parent, child) for parent in root.iter() for child in parent]
        if not elements:
            break
        parent, child = chance.choice(elements)
        kind = chance.randrange(8)
        if kind == 0:
            parent.remove(child)
        elif kind == 1:
            parent.append(copy.deepcopy(child))
        elif kind == 2:
            chance.choice(elements)[1].append(copy.deepcopy(child))
        elif kind == 3:
            child.tag = chance.choice(
                ("shape", "bsdf", "integer", "string", "include", "default", "ref", "texture", "x", "boolean")
            )
        elif kind in (4, 5) and child.attrib:
            word = chance.choice([w for w in WORDS if "\0" not in w])
            child.set(chance.choice(list(child.attrib)), word)
        elif kind == 6 and child.attrib:
            del child.attrib[chance.choice(list(child.attrib))]
        elif kind == 7:
            for _ in range(chance.choice((1, 5, 60))):
                deeper = ElementTree.SubElement(child, child.tag, child.attrib)
                parent, child = child, deeper
    return ElementTree.tostring(root, "utf-8")


_LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
#: Entities that grow to 10⁹ words, entities from other files, files that include themselves or what is no scene.
TRAPS = (
    f'<!DOCTYPE s [<!ENTITY l0 "lol">{_LAUGHS}]><scene version="3.0.0">&l9;</scene>'.encode(),
    f'<!DOCTYPE s [<!ENTITY l0 "lol">{_LAUGHS}]><scene version="3.0.0"><bsdf id="&l9;"/></scene>'.encode(),
    b'<!DOCTYPE s [<!ENTITY e SYSTEM "file:///etc/passwd">]><scene version="3.0.0"><bsdf type="&e;"/></scene>',
    b'<!DOCTYPE s [<!ENTITY % e SYSTEM "file:///etc/passwd"> %e;]><scene version="3.0.0"/>',
    b'<scene version="3.0.0"><include filename="../../../../../../etc/passwd"/></scene>',
    b'<scene version="3.0.0"><include filename="damaged.xml"/></scene>',
    b'<scene version="3.0.0"><include filename="/dev/zero"/></scene>',
    b'<scene version="3.0.0"><include filename="."/></scene>',
    b'<scene version="3.0.0">' + b"<bsdf>" * 20_000,
    b"<scene" + b' a="1"' * 20_000 + b"/>",
    b'<?xml version="1.0" encoding="utf-16"?><scene version="3.0.0"/>',
    b'<scene version="3.0.0"><default name="room" value="damaged.xml"/></scene>',
    b'<scene version="3.0.0"><default name="a" value="$a"/><bsdf type="$a"/></scene>',
)


def shader(chance: random.Random, good: bytes, corpus: Sequence[bytes]) -> bytes:
    """Words of a shader, or what a compiler chokes on."""
    if chance.random() < 0.25:
        head, body, kept = good.partition(b"vec3 shade")
        return head + chance.choice(SHADER_HEADS) + body + kept.replace(b"{", b"{" + chance.choice(SHADER_BODIES), 1)
    return text(chance, good, corpus)


SHADER_HEADS = (
    b"", b'#include "/etc/passwd"\n', b"#include </etc/passwd>\n", b"#version 110\n", b"#line 99999999 99\n", b"#if 1\n", b"/*",
    b"#define A A B\n#define B B A\n", b"#error no\n", b"#extension all : require\n", b"vec3 f(vec3 x) { return f(x); }\n",
    b"struct S { S s; };\n", b"float big[100000000];\n", b"float big[2147483647];\n", b"uniform sampler2D more[4096];\n",
    b"layout(location = 99999) out vec4 o;\n", b"uniform vec4 many[1000000];\n", b"buffer B { float data[]; };\n",
    b"void main() {}\n", b"struct Surface { int x; };\n", b"\xff\xfe\n", b"precision highp float;\n", b"vec3 shade(Surface s);\n",
    b"int f(int n) { return n / 0; }\n",
)  # fmt: skip
SHADER_BODIES = (
    b"", b"for (;;) {}", b"for (;;) { if (s.normal.x > 2.0) break; }", b"while (true) discard;", b"discard;", b"}}}}",
    b"int i = 0; do { i++; } while (i > -1);", b"float big[1000000]; big[int(s.normal.x)] = 1.0;", b"return vec3(1.0 / 0.0);",
    b"return vec3(sqrt(-1.0));", b"return vec3(0.0)", b"int a[4]; a[1000000000] = 1; return vec3(a[-5]);",
    b"return texelFetch(env_latlong, ivec2(-1000000000), 999).rgb;", b"return f(s.normal);", b"gl_FragDepth = 0.0 / 0.0;",
    b"for (int i = 0; i < 2147483647; i++) for (int j = 0; j < 2147483647; j++) if (s.normal.x > float(i)) return vec3(j);",
)  # fmt: skip
