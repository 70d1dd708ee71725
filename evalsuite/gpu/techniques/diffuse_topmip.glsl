uniform float below_top;  // 0 as published

vec3 shade(Surface s) {
    return diffuse_reflectance * textureLod(env_cube, s.normal, env_max_level - below_top).rgb;
}
