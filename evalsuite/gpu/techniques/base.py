"""What a technique declares. Importable without OpenGL."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from evalsuite.errors import EvalsuiteError
from evalsuite.scene.model import Environment, Material, Scene

if TYPE_CHECKING:
    from evalsuite.gpu.environment import GpuEnvironment

#: The one target that is not radiometric.
LOOKUP = "lookup"

Settings = Mapping[str, object]
Float = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """A parameter: `material` ones belong to the BSDF and reach both renderers, `technique` ones the GPU side alone.
    default None means chosen from the scene or its map, as `meaning` says. parse: value as given → value, or ValueError."""

    name: str
    default: object
    meaning: str
    kind: Literal["material", "technique"]
    parse: Callable[[object], object]
    expected: str


@dataclass(frozen=True)
class FreeParameter:
    """A `technique` parameter that could have been chosen otherwise: where `compare.headroom` looks for a better value.

    low, high: bounds of the value or, where the parameter's default is None, of its difference from what the technique filled
    in. step: between the first values tried. published: the paper's choice in words; its value is the default, or what was
    filled in. whole: only whole numbers count, and each is tried."""

    name: str
    low: float
    high: float
    step: float
    unit: str
    published: str
    whole: bool = False


@dataclass(frozen=True)
class StandsFor:
    """How a technique takes a material of one plugin. text: the mapping in words, for the page. uniforms: (material,
    settings) → shader uniforms. reason_against: why this very material cannot be taken, or None."""

    text: str
    uniforms: Callable[[Material, Settings], dict[str, object]]
    reason_against: Callable[[Material], str | None] = lambda material: None


@dataclass(frozen=True, eq=False)
class Prepared:
    """What an environment gives a technique's shader. prepare_ms: what making it cost, once. frame_ms: what has to be done
    in each frame before shading. probe: {"position", "faces": (6, w, w, 3)} of a map taken within the scene's room. defines: of
    the shader, as the environment decides them. before_pass: (frame, world → clip of its sub-sample, (4, 4)) → what has to be
    drawn before that pass's shading. rounds: how many passes each sub-sample is averaged over, where the environment decides
    that; None leaves it to the technique."""

    uniforms: Mapping[str, object] = field(default_factory=dict)
    textures: Mapping[str, object] = field(default_factory=dict)
    prepare_ms: float = 0.0
    notes: tuple[str, ...] = ()
    frame_ms: float = 0.0
    probe: Mapping[str, object] | None = None
    defines: Mapping[str, object] = field(default_factory=dict)
    before_pass: Callable[[Frame, Float], PassInputs] | None = None
    rounds: int | None = None


@dataclass(frozen=True)
class Frame:
    """One pass of a picture: its number, how many sub-samples and rounds of each there are, the picture's seed, and which
    round this is. All sub-samples of a round follow one another."""

    index: int
    subsamples: int
    rounds: int
    seed: int
    round: int = 0


@dataclass(frozen=True, eq=False)
class PassInputs:
    """What was drawn for one pass (shadows, say): its uniforms and textures, and what that takes in a frame of one pass a
    round [ms]."""

    uniforms: Mapping[str, object] = field(default_factory=dict)
    textures: Mapping[str, object] = field(default_factory=dict)
    ms: float = 0.0


#: (environment, normals (N, 3), to_view (N, 3), material parameters, settings) → radiance (N, 3), all float64, world frame.
Twin = Callable[[Environment, Float, Float, Settings, Settings], Float]

#: What is assumed, in the order in which assumptions are given up: each names one rung of an error ledger.
ARITHMETIC = "arithmetic"  # the shader, its float32 and its textures, for the formula in float64
REPRESENTATION = "environment representation"  # texels for the environment
KERNEL = "filter kernel"  # a box, a band limit or samples for the lobe that they stand for
ROUGHNESS = "roughness levels"  # a mix of prefiltered levels for the lobe of the material's own roughness
FRESNEL = "Fresnel outside"  # F at one angle before the integral for F within it, over the technique's own lobe
LOBE = "lobe"  # a round lobe without horizon for the BRDF's own integral
SAMPLING = "pixel sampling"  # sub-samples for the whole pixel, where nothing else is left
VISIBILITY, INTERREFLECTION, DISTANT = "visibility", "interreflection", "distant environment"


@dataclass(frozen=True)
class Lift:
    """One assumption given up: radiance is the picture with this one and all before it lifted, cause what the picture before
    it lacked. tolerance: of radiance, from its own numerics, relative to itself; of_change: to what it lifts. made_by: whether a
    material, of these parameters and its "plugin", is drawn under the assumption; where none of a scene's is, there is no rung.
    smooth: what is lifted varies so little within a pixel that a diagonal of its sub-samples is enough."""

    cause: str
    radiance: Twin
    tolerance: float = 1e-6
    of_change: float = 0.0
    made_by: Callable[[Settings], bool] = lambda material: True
    smooth: bool = False


@dataclass(frozen=True, eq=False)
class Technique:
    """A real-time approximation: what it is, what truth it is held against, and how it is drawn.

    shader: GLSL file that defines `vec3 shade(Surface s)` (see gpu/glsl/surface.glsl for what it may use); with vertex_stage
    also `vec3 shade_vertex(vec3 normal)`. library: files of gpu/glsl/library compiled in before it. target: what Mitsuba
    renders for it; target_bsdf: parameters → Mitsuba plugin dictionary of plain values that a report binds to the subject.
    prepare: (environment, settings, scene) → uniforms and textures. twin: (environment, normals, to_view, material
    parameters, settings) → (N, 3) float64 radiance, an independent NumPy computation of what shade() returns. twin_bound:
    largest difference between the two over the twin's mean on a CPU renderer, for twin_bound_reason, with twin_settings.
    resolves: fill() finds material parameters in the picture, so the target waits for it. random: standard error comes with
    the picture. within_room: it draws `scene.room`, which the scene must name. casts_shadows: its twin needs each light's
    visibility at each point beside the settings. chain: settings → (target, cause) from full truth to the technique: the cause is
    what separates that target's picture from the next one's, the last from the technique's own. layers: `#define`s of each draw
    of a mesh, one over the other. rounds: how many passes each sub-sample is averaged over; per_pass: uniforms of one pass.
    fill: (scene, settings, with the names "given") → values for parameters that are still open. fit: an analysis of the
    picture for the page. free: parameters whose best value `--headroom` looks for. lifts: settings → the technique's assumptions
    about an unoccluded surface, one after another given up in float64, from its formula (the twin) towards the BRDF's own
    integral; None: the formula alone. left: what still separates the last of them from that integral. represented:
    (environment, settings) → the environment as the technique's finest map holds it, where the filter can be made exact on it:
    assumptions are then given up in another order too.
    """

    id: str
    title: str
    paper: str
    equations: str
    parameters: tuple[Parameter, ...]
    assumptions: tuple[str, ...]
    stands_for: Mapping[str, StandsFor]
    target_bsdf: Callable[[Settings], dict[str, object]]
    shader: Path
    prepare: Callable[[GpuEnvironment, Settings, Scene], Prepared]
    twin: Twin | None
    target: str = "unoccluded"
    library: tuple[str, ...] = ()
    twin_bound: float = 2e-4
    twin_bound_reason: str = "float32 coordinates of r and of the resampled map"
    twin_settings: Mapping[str, object] = field(default_factory=dict)
    resolves: bool = False
    vertex_stage: bool = False
    random: bool = False
    within_room: bool = False
    casts_shadows: bool = False
    chain: Callable[[Settings], Sequence[tuple[str, str]]] = lambda settings: ()
    defines: Callable[[Settings], Mapping[str, object]] = lambda settings: {}
    layers: Callable[[Settings], Sequence[Mapping[str, object]]] = lambda settings: ({},)
    rounds: Callable[[Settings, int], int] = lambda settings, subsamples: 1
    per_pass: Callable[[Frame, Settings], Mapping[str, object]] | None = None
    fill: Callable[[Scene, Settings], Mapping[str, object]] = lambda scene, settings: {}
    fit: Callable[[Scene, GpuEnvironment, Settings], Mapping[str, float] | None] | None = None
    free: tuple[FreeParameter, ...] = ()
    path: Path | None = None
    lifts: Callable[[Settings], Sequence[Lift]] | None = None
    left: str = LOBE
    represented: Callable[[Environment, Settings], Environment] | None = None

    def lifted(self, settings: Settings) -> tuple[Lift, ...]:
        """`lifts`, or the twin alone; none where a twin needs more than a point of the surface, or draws no light."""
        if self.twin is None or self.random or self.within_room or self.casts_shadows or self.target == LOOKUP:
            return ()
        return tuple(self.lifts(settings)) if self.lifts else (Lift(ARITHMETIC, self.twin),)

    @property
    def name(self) -> str:
        """What `registry.find` finds it by: its id, or the path of a user's own shader."""
        return str(self.path) if self.path else self.id

    def reason_against(self, material: Material) -> str | None:
        """Why the technique cannot stand for a material, or None if it can."""
        if material.plugin not in self.stands_for:
            return f"{self.id} stands for {', '.join(self.stands_for)}, not for {material.plugin}"
        return self.stands_for[material.plugin].reason_against(material)

    def reason_against_target(self, target: str) -> str | None:
        """Why the technique cannot be held against a target, or None if it can."""
        if (target == LOOKUP) == (self.target == LOOKUP):
            return None
        if target == LOOKUP:
            return f"{self.id} draws light; the target {LOOKUP} holds a map that no light reaches"
        return f"{self.id} draws no light, so that '{target}' is no truth for it; its target is {LOOKUP}"

    def scored_materials(self, scene: Scene) -> frozenset[int]:
        """Indices of the materials that the technique stands for and the scene's subject (if it names any) counts."""
        wanted = [i for i in scene.used_materials if not scene.subject or scene.materials[i].id in scene.subject]
        return frozenset(i for i in wanted if self.reason_against(scene.materials[i]) is None)

    def defaults(self) -> dict[str, object]:
        """Every parameter with its default; None where it is chosen from the scene."""
        return {p.name: p.default for p in self.parameters}

    def to_json(self) -> dict[str, object]:
        """What `evalsuite list techniques` and the page print."""
        return {
            "id": self.id,
            "title": self.title,
            "paper": self.paper,
            "equations": self.equations,
            "parameters": [{"name": p.name, "default": p.default, "meaning": p.meaning, "kind": p.kind} for p in self.parameters],
            "assumptions": list(self.assumptions),
            "stands_for": {plugin: how.text for plugin, how in self.stands_for.items()},
            "target": self.target,
            "free": [f.name for f in self.free],
        }

    def parse(self, given: Settings) -> dict[str, object]:
        """Given parameters, each in its type; None means not given. Raises EvalsuiteError for unknown names and values."""
        known = {p.name: p for p in self.parameters}
        parsed = {}
        for name, value in given.items():
            if name not in known:
                raise EvalsuiteError(
                    self.id, f"parameter '{name}'", f"one of {', '.join(known)}", "see `evalsuite list techniques`"
                )
            if value is None:
                continue
            try:
                parsed[name] = known[name].parse(value)
            except (TypeError, ValueError) as error:
                raise EvalsuiteError(f"{self.id}, parameter {name}", repr(value), known[name].expected) from error
        return parsed

    def resolved(self, scene: Scene, given: Settings) -> dict[str, object]:
        """Every parameter with its value for this scene. Raises EvalsuiteError."""
        settings = {p.name: p.default for p in self.parameters}
        plugin = self.target_bsdf(settings | self.parse(given))["type"]
        for index in scene.used_materials:
            material = scene.materials[index]
            if material.plugin == plugin and (not scene.subject or material.id in scene.subject):
                own = {
                    n: v for n, v in material.parameters.items() if n in settings and n not in material.textures and v is not None
                }
                settings.update(self.parse(own))
                break
        settings.update(self.parse(given))
        # fill() sees what was given apart from what is still open (None).
        settings.update(self.fill(scene, {**settings, "given": frozenset(self.parse(given))}))
        return settings
