"""The forward renderer: every material through its technique's shader, averaged over a sub-pixel grid.

Anti-aliasing matches a 1-pixel box filter with s × s passes at full resolution, each with the projection moved to one
sub-sample: the hardware's own derivatives, hence its MIP level, stay those of one sample a pixel, as in the papers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, log2

import numpy as np
from scipy.special import stdtrit

from evalsuite.errors import EvalsuiteError
from evalsuite.gpu import environment, material_maps, programs
from evalsuite.gpu.drawing import Drawing
from evalsuite.gpu.passes import Draw, Stage, background_draw
from evalsuite.gpu.plan import Binding, plan, require_can_stand_for
from evalsuite.gpu.techniques.base import Frame, PassInputs, Prepared, Technique
from evalsuite.math.pixel import subsamples
from evalsuite.scene.model import Scene

#: Colours that material.glsl sets before a shader runs, from these values or from bitmaps.
_REFLECTANCES = ("diffuse_reflectance", "specular_reflectance")


def draw(scene: Scene, technique: Technique, parameters: Mapping[str, object], supersample: int = 4, seed: int = 0) -> Drawing:
    """Picture of a scene by one technique.

    parameters: the technique's own; missing ones take their defaults, those of materials are read from the scene. seed: of
    techniques that sample at random. Raises EvalsuiteError for what cannot be drawn or stood for.
    """
    if not 1 <= supersample <= 16:
        raise EvalsuiteError("supersample", repr(supersample), "1 to 16 sub-samples a side", "choose 4")
    scene.require_drawable()
    require_can_stand_for(technique, scene)
    env = environment.of(scene.environment)
    settings: dict[str, dict[str, object]] = {}
    prepared: dict[str, Prepared] = {}
    bindings = plan(technique, scene)
    for binding in bindings.values():
        one = binding.technique
        if one.id not in prepared:
            settings[one.id] = one.resolved(scene, parameters if one is technique else {})
            prepared[one.id] = one.prepare(env, settings[one.id], scene)

    draws = [_material_draws(scene, i, bindings, settings, prepared, supersample) for i in range(len(scene.materials))]
    scored = [float(i in bindings and bindings[i].scored) for i in range(len(scene.materials))]
    stage, sky = Stage(scene), background_draw(env.latlong, env.uniforms)
    width, height = scene.camera.size
    total, variance = np.zeros((height, width, 4)), np.zeros((height, width, 3))
    grid = subsamples(supersample)
    rounds = prepared[technique.id].rounds or technique.rounds(settings[technique.id], len(grid))
    passes = [(number, subsample) for number in range(rounds) for subsample in grid]
    before_ms: list[float] = []
    for index, (number, subsample) in enumerate(passes):
        frame = Frame(index, len(grid), rounds, seed, number)
        if technique.per_pass is not None:
            draws = _with(draws, PassInputs(technique.per_pass(frame, settings[technique.id])))
        before = [p.before_pass(frame, stage.clip(subsample)) for p in prepared.values() if p.before_pass]
        for inputs in before:
            draws = _with(draws, inputs)
        before_ms.append(sum(inputs.ms for inputs in before))
        stage.run(subsample, draws, sky)
        stage.mark(subsample, scored)
        total += stage.read(0)
        if technique.random:
            variance += stage.read(1)[..., :3]

    mean = total / len(passes)
    own = prepared[technique.id]
    shadow_ms = rounds * float(np.mean(before_ms[1:] or before_ms))
    totals = np.add(before_ms, stage.pass_ms)[1:]
    # The passes of a round may share what was drawn before them: then the rounds are what varies by itself.
    spread_ms = rounds * _half_width(
        [part.mean() for part in np.array_split(totals, rounds) if len(part)] if rounds > 1 else totals
    )
    gpu_ms = own.frame_ms + shadow_ms + rounds * float(np.mean(stage.pass_ms[1:] or stage.pass_ms))
    return Drawing(
        image=mean[..., :3].astype(np.float32),
        scored=mean[..., 3].astype(np.float32),
        standard_error=(np.sqrt(variance) / len(passes)).astype(np.float32) if technique.random else None,
        # The first pass warms caches and compiles; where there are others it is left out.
        cost={
            "gpu_ms": gpu_ms,
            **({"gpu_ms_ci95": [gpu_ms - spread_ms, gpu_ms + spread_ms]} if np.isfinite(spread_ms) else {}),
            "prepare_ms": own.prepare_ms,
            **({"shadow_ms": shadow_ms} if shadow_ms else {}),
            **({"acquire_ms": own.frame_ms} if own.frame_ms else {}),
        },
        mapping=[b.describe(scene, settings[b.technique.id]) for b in bindings.values()],
        parameters=settings[technique.id],
        fit=technique.fit(scene, env, settings[technique.id]) if technique.fit else None,
        notes=tuple(own.notes) + _side_notes(scene, bindings),
        probe=own.probe,
    )


def _half_width(values: Sequence[float] | np.ndarray) -> float:
    """Of the 95 % interval of their mean, by Student's t; infinite for fewer than two."""
    return float(stdtrit(len(values) - 1, 0.975) * np.std(values, ddof=1) / len(values) ** 0.5) if len(values) > 1 else inf


def _with(draws: Sequence[Sequence[Draw]], inputs: PassInputs) -> list[list[Draw]]:
    """Draws with what one pass adds to each."""
    return [
        [Draw(d.program, {**d.uniforms, **inputs.uniforms}, {**d.textures, **inputs.textures}) for d in layers]
        for layers in draws
    ]


def _material_draws(
    scene: Scene,
    index: int,
    bindings: Mapping[int, Binding],
    settings: Mapping[str, Mapping[str, object]],
    prepared: Mapping[str, Prepared],
    supersample: int,
) -> list[Draw]:
    """The draws of one material, one a layer of its technique; none for a material no mesh uses."""
    if index not in bindings:
        return []
    binding, material = bindings[index], scene.materials[index]
    one = binding.technique
    own = settings[one.id]
    maps, map_uniforms, map_defines = material_maps.of(material)
    material_uniforms = binding.stands_for.uniforms(material, own)
    uniforms = {
        **prepared[one.id].uniforms,
        **material_uniforms,
        **{f"{name}_value": material_uniforms[name] for name in _REFLECTANCES if name in material_uniforms},
        **map_uniforms,
        "map_bias": -log2(supersample),
        "two_sided": material.two_sided,
    }
    common = {**one.defines(own), **prepared[one.id].defines, **map_defines, **({"WITH_VARIANCE": 1} if one.random else {})}
    programs_of_layers = [
        programs.technique_program(one.shader, library=one.library, vertex_stage=one.vertex_stage, defines={**common, **layer})
        for layer in one.layers(own)
    ]
    return [Draw(program, uniforms, {**prepared[one.id].textures, **maps}) for program in programs_of_layers]


def _side_notes(scene: Scene, bindings: Mapping[int, Binding]) -> tuple[str, ...]:
    notes = []
    for index, binding in bindings.items():
        if not binding.own:
            left_out = binding.technique.reason_against(scene.materials[index])
            notes.append(f"{scene.materials[index].id} is drawn by {binding.technique.id} and not scored"
                         + (f"; left out: {left_out}" if left_out else ""))  # fmt: skip
    return tuple(notes)
