"""A small scene of one object, as XML."""

SCENE = """<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="1.5, 1, 3.5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="32"/>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="40"/></film>
    </sensor>
    {emitter}
    <bsdf type="{plugin}" id="{material}">{parameters}</bsdf>
    <shape type="{shape}">{shape_parameters}<ref id="{material}"/></shape>
    {extra}
</scene>
"""


def scene_xml(
    emitter: str = '<emitter type="constant"><rgb name="radiance" value="1"/></emitter>',
    plugin: str = "diffuse",
    material: str = "clay",
    parameters: str = '<rgb name="reflectance" value="0.5"/>',
    shape: str = "sphere",
    shape_parameters: str = "",
    extra: str = "",
) -> str:
    """A small scene of one object."""
    return SCENE.format(
        emitter=emitter,
        plugin=plugin,
        material=material,
        parameters=parameters,
        shape=shape,
        shape_parameters=shape_parameters,
        extra=extra,
    )
