uniform vec3 env_mean;  // the level after the last: math.seamless_mips.mean_radiance
uniform float level;
uniform float bias;
uniform float lod_offset;  // 0 as published

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
#ifdef AT_BIAS
    float m = face_lod(r, dFdx(r), dFdy(r), env_face_size) + bias;
#else
    float m = level;
#endif
    m += lod_offset;
    return specular_reflectance * mix(textureLod(env_cube, r, m).rgb, env_mean, clamp(m - env_max_level, 0.0, 1.0));
}
