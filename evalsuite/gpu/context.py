"""One headless OpenGL context a process, through EGL: a real GPU's driver where there is one, else Mesa's llvmpipe."""

from __future__ import annotations

import os
from functools import cache

import moderngl

from evalsuite.errors import EvalsuiteError, MachineLacks

REQUIRED = 430  # compute shaders, explicit uniform layout, image stores to cubes
APT = "apt-get install libegl1 libgl1-mesa-dri"
SEAMLESS = 0x884F  # GL_TEXTURE_CUBE_MAP_SEAMLESS, unknown to moderngl
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swr", "software")


@cache
def get() -> moderngl.Context:
    """This process's context, OpenGL ≥ 4.3, seamless cubes on. Raises MachineLacks where none can be made.

    EVALSUITE_GL_DEVICE picks the EGL device by its index; without it the first usable one serves, hardware preferred.
    """
    chosen = os.environ.get("EVALSUITE_GL_DEVICE", "").strip()
    if chosen and not chosen.isdecimal():
        raise EvalsuiteError("EVALSUITE_GL_DEVICE", repr(chosen), "the index of an EGL device, e.g. 0", "unset it")
    software, failures = None, []
    for device in [int(chosen)] if chosen else range(4):
        try:
            context = moderngl.create_context(standalone=True, backend="egl", require=REQUIRED, device_index=device)
        except Exception as error:  # glcontext raises bare Exception for whatever libEGL says
            failures.append(str(error))
            if device == 0 and "libEGL" in str(error):
                break  # the library itself is missing
            continue
        if not is_software(context):
            if software is not None:
                software.release()
            return _prepared(context)
        if software is None:
            software = context
        else:
            context.release()
    if software is None:
        raise MachineLacks("OpenGL", failures[0] if failures else "no EGL device", "a headless OpenGL ≥ 4.3 through EGL", APT)
    return _prepared(software)


def _prepared(context: moderngl.Context) -> moderngl.Context:
    context.__enter__()
    context.gc_mode = "auto"
    context.enable_direct(SEAMLESS)
    context.clear_errors()
    return context


def is_software(context: moderngl.Context) -> bool:
    """True for a renderer that runs on the CPU."""
    return any(name in context.info["GL_RENDERER"].lower() for name in _SOFTWARE)


def check_errors(what: str) -> None:
    """Raise EvalsuiteError if OpenGL recorded an error since the last check. what: the step just done."""
    error = get().error
    if error != "GL_NO_ERROR":
        raise EvalsuiteError(f"OpenGL, {what}", error, "GL_NO_ERROR", "try a smaller picture or face_size")


def check_texture_size(what: str, width: int, height: int) -> None:
    """Raise EvalsuiteError if a width × height texture is more than this OpenGL holds."""
    limit = get().info["GL_MAX_TEXTURE_SIZE"]
    if max(width, height) > limit:
        raise EvalsuiteError(
            what, f"{width}×{height}", f"at most {limit} a side on {get().info['GL_RENDERER']}", "make it smaller"
        )


def probe() -> dict[str, object]:
    """What this machine's OpenGL is. Raises MachineLacks."""
    context = get()
    info = context.info
    return {
        "renderer": info["GL_RENDERER"],
        "vendor": info["GL_VENDOR"],
        "version": info["GL_VERSION"],
        "version_code": context.version_code,
        "max_texture_size": info["GL_MAX_TEXTURE_SIZE"],
        "max_cube_size": info["GL_MAX_CUBE_MAP_TEXTURE_SIZE"],
        "software": is_software(context),
    }
