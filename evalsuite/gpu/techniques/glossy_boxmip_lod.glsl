uniform float lod_offset;  // 0 as published

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    return specular_reflectance * textureLod(env_cube, r, exponent_to_lod(exponent, env_face_size) + lod_offset).rgb;
}
