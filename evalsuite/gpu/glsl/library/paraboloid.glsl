// Dual paraboloid maps: alpha is 1 in the circle (and its ring), 0 beyond.
uniform sampler2D front_map;
uniform sampler2D back_map;
uniform mat4 front_matrix;  // texture matrices, math.paraboloid.texture_matrix
uniform mat4 back_matrix;

// Texture coordinates of a unit world direction. At the other map's centre q is 0 and they are infinitely far away.
vec2 paraboloid_coordinates(mat4 texture_matrix, vec3 r) {
    vec4 q = texture_matrix * vec4(r, 1.0);
    return q.xy / max(q.w, 1e-6);
}

// Alpha is 0 beyond the map, where the look-up is clamped to its edge and, with far coordinates, λ to the 1 × 1 level.
vec4 paraboloid_texel(sampler2D map, mat4 texture_matrix, vec3 r) {
    vec2 st = paraboloid_coordinates(texture_matrix, r);
#ifdef HARDWARE_LOD
    vec4 texel = texture(map, st);
#else
    vec4 texel = textureLod(map, st, 0.0);
#endif
    bool beyond = any(greaterThan(abs(st - 0.5), vec2(0.5)));
    return beyond ? vec4(texel.rgb, 0.0) : texel;
}
