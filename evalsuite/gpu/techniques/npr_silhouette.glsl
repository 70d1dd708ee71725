// math.npr.colour, as a texture; npr_lookup is library/npr.glsl's.
vec3 shade(Surface s) {
    return npr_lookup(s);
}
