"""Which technique draws which material of a scene. No OpenGL here: the planner of a report asks this too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu.techniques import TECHNIQUES
from evalsuite.gpu.techniques.base import StandsFor, Technique
from evalsuite.scene.model import Scene, Texture

#: Who draws a material that the technique at hand cannot stand for. Such pixels are never scored.
COMPANIONS: Mapping[str, str] = {
    "diffuse": "diffuse-sh9",
    "phong": "glossy-mcguire",
    "blinnphong": "glossy-mcguire",
    "roughconductor": "glossy-mcguire",
    "conductor": "mirror-cube",
    "fresnelmirror": "fresnel-blend",
    "plastic": "fresnel-blend",
    "kautz": "kautz-combined",
    "roughplastic": "kautz-combined",
    "npr": "npr-cool-warm",
}


@dataclass(frozen=True)
class Binding:
    """A material (by its index in Scene.materials), who draws it, how it is mapped, whether the technique at hand itself
    does so (own), and whether its pixels count (scored)."""

    material: int
    technique: Technique
    stands_for: StandsFor
    own: bool
    scored: bool

    def describe(self, scene: Scene, settings: Mapping[str, object]) -> dict[str, object]:
        """The mapping as the page prints it."""
        material = scene.materials[self.material]
        uniforms = self.stands_for.uniforms(material, settings)
        derived = {name: uniforms[name] for name in ("exponent", "bias") if name in uniforms}
        return {
            "material": material.id,
            "plugin": material.plugin,
            "technique": self.technique.id,
            "text": self.stands_for.text,
            "parameters": {name: str(v) if isinstance(v, Texture) else v for name, v in material.parameters.items()} | derived,
            "scored": self.scored,
        }


def cannot_stand_for(technique: Technique, scene: Scene) -> str | None:
    """Why the technique has nothing to be scored on in the scene, or None if it has."""
    if technique.within_room and scene.room_file is None:
        return f"{technique.id} draws the scene's real surroundings, and the scene names no room"
    if technique.scored_materials(scene):
        return None
    wanted = [i for i in scene.used_materials if not scene.subject or scene.materials[i].id in scene.subject]
    if not wanted:
        return "no mesh carries " + (f"the subject ({', '.join(scene.subject)})" if scene.subject else "a material")
    return "; ".join(f"{scene.materials[i].id}: {technique.reason_against(scene.materials[i])}" for i in wanted)


def require_can_stand_for(technique: Technique, scene: Scene) -> None:
    """Raise EvalsuiteError if the technique stands for no material that counts."""
    reason = cannot_stand_for(technique, scene)
    if reason:
        plugins = ", ".join(technique.stands_for)
        raise EvalsuiteError(scene.path, reason, f"a material that {technique.id} stands for ({plugins})",
                             "bind the subject to one, or choose another technique")  # fmt: skip


def plan(technique: Technique, scene: Scene) -> dict[int, Binding]:
    """A binding for each material that a mesh carries. Raises EvalsuiteError for a plugin that no technique draws."""
    scored, bindings = technique.scored_materials(scene), {}
    for index in scene.used_materials:
        material = scene.materials[index]
        own = technique.reason_against(material) is None
        one = technique if own else TECHNIQUES.get(COMPANIONS.get(material.plugin, ""))
        if one is None:
            raise EvalsuiteError(material.location or scene.path, f"{material.plugin} '{material.id}'",
                                 f"a BSDF the GPU side can draw: {', '.join(COMPANIONS)}", "change it")  # fmt: skip
        bindings[index] = Binding(index, one, one.stands_for[material.plugin], own, index in scored)
    return bindings
