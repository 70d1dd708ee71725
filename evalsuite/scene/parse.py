"""Mitsuba's XML parser, with our bindings and paths worked in and every failure turned into one line with its place.

The parser's state is a list of nodes; `instantiate` uses a state up, so each object that is made on its own gets a state of
its own (parsing costs milliseconds).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from evalsuite.errors import EvalsuiteError
from evalsuite.image.exr import read_parts
from evalsuite.image.inspect import check_picture, is_exr
from evalsuite.scene.dependencies import is_file
from evalsuite.scene.mesh_files import mesh_problem
from evalsuite.scene.model import OWN, SceneSource, own_name

_PLACE = re.compile(r"(?:At|While loading|Error while loading) (?P<place>[^\n]+? \(line \d+, col \d+\)): ?(?P<what>.*)", re.S)
_XML_FILE = re.compile(r'(?:Parsing of XML file|Error while loading XML file) "(?P<place>.+?)"(?: failed)?: (?P<what>.*)', re.S)


#: BSDFs that change another one, which their first child is.
WRAPPERS = ("twosided", "normalmap")
#: Plugins that end the process when they are given no file.
OF_FILES = ("bitmap", "ply", "obj", "serialized")


class ParsedScene:
    """One parse of `source.path`: references resolved, ids given to unnamed nodes, files absolute, bindings applied."""

    def __init__(self, source: SceneSource) -> None:
        import mitsuba as mi

        self.mi, self.source, self.path = mi, source, source.path.absolute()
        if not self.path.is_file():
            found = "a folder" if self.path.is_dir() else "no such file"
            raise EvalsuiteError(source.path, found, "a Mitsuba scene (.xml)", "check the path")
        self.config = mi.parser.ParserConfig(mi.variant())
        # Shapes and BSDFs stay apart, so that each keeps its id, its line and its own material.
        self.config.merge_meshes = self.config.merge_equivalent = False
        # A scene and its room share their parameters; `load` checks the names.
        self.config.unused_parameters = mi.LogLevel.Debug
        self.state = self._parse()
        self.nodes = self.state.nodes
        # Read from a second parse: reading a property counts as its use, and `instantiate` reports those that nobody used.
        read = self._parse()
        self._plugins = [node.props.plugin_name() for node in read.nodes]
        self._locations = [mi.parser.file_location(read, node) for node in read.nodes]
        self._links = [self._links_of(node.props) for node in read.nodes]
        self._properties = [
            {key: node.props[key] for key in node.props.keys() if key not in links}
            for node, links in zip(read.nodes, self._links, strict=True)
        ]
        if self._plugins[0] != "scene":
            raise EvalsuiteError(self.path, f"<{self._plugins[0]}>", "<scene> at the root")
        self.ids = self._name_nodes()
        self._bind(source.bindings)

    def _parse(self) -> Any:
        with self._mitsuba_errors():
            state = self.mi.parser.parse_file(self.config, str(self.path), **self.source.defines)
            self.mi.parser.transform_all(self.config, state)
        return state

    def kind(self, index: int) -> str:
        """'Shape', 'BSDF', 'Emitter', …"""
        return str(self.nodes[index].type).rpartition(".")[2]

    def plugin(self, index: int) -> str:
        return self._plugins[index]

    def location(self, index: int) -> str:
        """ "file.xml (line 4, col 4)"."""
        return self._locations[index]

    def properties(self, index: int) -> dict[str, Any]:
        """Plain properties, without child objects."""
        return self._properties[index]

    def children(self, index: int, kind: str | None = None) -> list[int]:
        """Indices of child objects, in the order of the file."""
        return [i for i in self._links[index].values() if kind is None or self.kind(i) == kind]

    def child(self, index: int, key: str) -> int | None:
        """Index of the child object that is a property, or None."""
        return self._links[index].get(key)

    def innermost(self, index: int) -> int:
        """The BSDF inside its wrappers."""
        while self.plugin(index) in WRAPPERS and self.children(index, "BSDF"):
            index = self.children(index, "BSDF")[0]
        return index

    def remove_child(self, parent: int, child: int) -> None:
        for key in [k for k, i in self._links[parent].items() if i == child]:
            del self.nodes[parent].props[key]
            del self._links[parent][key]

    def put(self, index: int, key: str, value: Any) -> None:
        """Set a property, plain or an object of Mitsuba's."""
        self.nodes[index].props[key] = value

    def instantiate(self, index: int = 0) -> Any:
        """The object of a node; uses this parse up. Raises EvalsuiteError with file and line."""
        self._resolve_files(index)
        if index:
            self.nodes[0] = self.nodes[index]
        with self._mitsuba_errors():
            return self.mi.parser.instantiate(self.config, self.state)

    def _links_of(self, props: Any) -> dict[str, int]:
        """Property name → index of the child node."""
        link = self.mi.Properties.ResolvedReference
        return {k: props[k].index() for k in props.keys() if isinstance(props[k], link)}

    def _name_nodes(self) -> dict[str, int]:
        """id → index; nodes without one are called <plugin>-<n>."""
        ids = {node.props.id(): i for i, node in enumerate(self.nodes) if node.props.id()}
        self.named = set(ids)
        counts: dict[str, int] = {}
        for i, node in enumerate(self.nodes):
            if node.props.id():
                continue
            plugin = node.props.plugin_name()
            while True:
                counts[plugin] = counts.get(plugin, 0) + 1
                name = f"{plugin}-{counts[plugin]}"
                if name not in ids:
                    break
            node.props.set_id(name)
            ids[name] = i
        return ids

    def _bind(self, bindings: Mapping[str, Mapping[str, object]]) -> None:
        """Put the bound plugins in place of BSDFs; of a `twosided` or `normalmap`, in place of what it wraps. Parameters
        whose value is OWN stay as the scene has them."""
        for name, plugin in bindings.items():
            index = self.ids.get(name)
            if index is None or self.kind(index) != "BSDF":
                known = sorted(i for i, n in self.ids.items() if self.kind(n) == "BSDF")
                raise EvalsuiteError(
                    self.path, f"a binding of '{name}'", f"the id of a BSDF: {', '.join(known) or 'it has none'}"
                )
            if not isinstance(plugin.get("type"), str):
                raise EvalsuiteError(f"binding '{name}'", f"{dict(plugin)}", "a plugin dictionary with a 'type'")
            if plugin["type"] not in WRAPPERS:
                if self.plugin(index) == "twosided":
                    for other in self.children(index, "BSDF")[1:]:
                        self.remove_child(index, other)
                index = self.innermost(index)
            props = self.nodes[index].props
            owned = {key: own_name(key, props.keys()) for key, value in plugin.items() if value == OWN}
            kept = set(owned)
            for key, own in owned.items():
                if own and own != key:
                    self._rename(index, own, key)
            for key in set(props.keys()) - kept:
                del props[key]
            props.set_plugin_name(plugin["type"])
            values = {key: self._plain(name, key, value) for key, value in plugin.items() if key != "type" and key not in kept}
            for key, value in values.items():
                props[key] = value
            self._plugins[index] = plugin["type"]
            self._properties[index] = {k: v for k, v in self._properties[index].items() if k in kept} | values
            self._links[index] = {k: i for k, i in self._links[index].items() if k in kept}

    def _rename(self, index: int, old: str, new: str) -> None:
        """A property, plain or a child, under another name."""
        props = self.nodes[index].props
        props[new] = props[old]
        del props[old]
        for known in (self._properties[index], self._links[index]):
            if old in known:
                known[new] = known.pop(old)

    def _plain(self, name: str, key: str, value: object) -> object:
        if isinstance(value, bool | str):
            return value
        try:
            if isinstance(value, tuple | list) or getattr(value, "ndim", 0) == 1:
                red, green, blue = (float(c) for c in value)  # type: ignore[union-attr]
                return self.mi.ScalarColor3d(red, green, blue)
            return float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError) as error:
            raise EvalsuiteError(f"binding '{name}'", f"{key} = {value!r}", "a number, three numbers or a string") from error

    def _resolve_files(self, root: int) -> None:
        """Make the files of all nodes below root absolute, relative ones against the XML's folder first."""
        pending, seen = [root], set()
        while pending:
            index = pending.pop()
            if index in seen:
                continue
            seen.add(index)
            pending += self.children(index)
            name = self.properties(index).get("filename")
            if self.plugin(index) in OF_FILES and not isinstance(name, str):
                raise EvalsuiteError(self.location(index), f"a {self.plugin(index)} without a filename", "a file", "name one")
            if isinstance(name, str):
                file = self.file(index)
                if self.plugin(index) in ("bitmap", "envmap"):
                    check_picture(file)
                    if self.plugin(index) == "bitmap" and is_exr(file):  # Mitsuba's own reader can end the process
                        del self.nodes[index].props["filename"]
                        self.nodes[index].props["bitmap"] = self.mi.Bitmap(next(iter(read_parts(file).values())))
                        continue
                number = self.properties(index).get("shape_index", 0)
                problem = mesh_problem(file, self.plugin(index), number if isinstance(number, int) else 0)
                if problem:
                    wanted = f"a complete {self.plugin(index)} mesh of triangles"
                    raise EvalsuiteError(self.location(index), f"{file} with {problem}", wanted, "write the file again")
                self.nodes[index].props["filename"] = str(file)

    def file(self, index: int) -> Path:
        """Absolute path of a node's `filename`. Raises EvalsuiteError when there is no such file."""
        name = str(self.properties(index)["filename"])
        path = self.path.parent / name  # an absolute name stays as it is
        if not is_file(path):
            with self._scene_folder():
                path = Path(str(self.mi.file_resolver().resolve(name)))  # Mitsuba's own data
        if not is_file(path):
            raise EvalsuiteError(
                self.location(index),
                f"no file '{name}'",
                f"a file, absolute or relative to {self.path.parent}",
                f"check the path of this {self.plugin(index)}",
            )
        return path.absolute()

    @contextmanager
    def _scene_folder(self) -> Iterator[None]:
        """Mitsuba looks for included and data files beside the XML first."""
        resolver = self.mi.file_resolver()
        before = [resolver[i] for i in range(len(resolver))]
        resolver.prepend(str(self.path.parent))
        try:
            yield
        finally:
            resolver.clear()
            for folder in before:
                resolver.append(folder)

    @contextmanager
    def _mitsuba_errors(self) -> Iterator[None]:
        try:
            with self._scene_folder():
                yield
        except EvalsuiteError:
            raise
        except Exception as error:  # bindings raise RuntimeError mostly, TypeError and others from plugin constructors
            raise translate_error(error, self.path) from error


def translate_error(error: Exception, path: Path) -> EvalsuiteError:
    """Mitsuba's exception as one line: the innermost place it names, what it found, what it wants."""
    text = str(error)
    place: object = path
    if match := _XML_FILE.search(text):
        place, text = match["place"], match["what"]
    while match := _PLACE.search(text):
        place, text = match["place"], match["what"]
    if "Traceback (most recent call last)" in text:  # a Python plugin's constructor: only the last line says what happened
        prefix, text = text.split("Traceback", 1)[0], [line for line in text.splitlines() if line.strip()][-1]
        text = text.partition(": ")[2] or text
        plugin = re.search(r'plugin of type "(\w+)"', prefix)
        if match := re.match(r"(?P<plugin>\w+): got (?P<got>.*), expected (?P<expected>.*)", text):
            return EvalsuiteError(place, f"{match['plugin']} with {match['got']}", match["expected"])
        text = f"{plugin[1]}: {text}" if plugin else text
    text = " ".join(re.sub(r"\[[\w.]+(:\d+)?\] ", "", text).split())
    return _explain(place, text)


def _explain(place: object, text: str) -> EvalsuiteError:
    if m := re.search(r'instantiate (\w+) plugin of type "(.+?)": Plugin ".+?" not found', text):
        return EvalsuiteError(place, f'unknown {m[1]} plugin "{m[2]}"', "a plugin of Mitsuba or evalsuite", "check its spelling")
    if m := re.search(r'Found \d+ unreferenced propert\w+ in (\w+) plugin of type "(.+?)": (.*)', text):
        return EvalsuiteError(
            place,
            f"unknown property of the {m[1]} '{m[2]}': {m[3].lstrip('- ')}",
            "properties that this plugin has",
            "check the spelling, or remove it",
        )
    if m := re.search(r'unresolved reference to "(.+?)"', text):
        return EvalsuiteError(place, f'a reference to "{m[1]}"', "the id of an object in this file", "define it, or mend the id")
    if m := re.search(r"undefined parameter: (\$\w+)", text):
        return EvalsuiteError(place, f"the parameter {m[1]} without a value", "a value", 'add <default name="…" value="…"/>')
    if "tags mismatch" in text or "No document element" in text or "Error parsing" in text:
        return EvalsuiteError(place, f"broken XML: {text}", "a well-formed Mitsuba scene file")
    return EvalsuiteError(place, text[:300] or "an unknown failure", "a scene that Mitsuba can load")
