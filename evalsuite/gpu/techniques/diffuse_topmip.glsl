vec3 shade(Surface s) {
    return diffuse_reflectance * textureLod(env_cube, s.normal, env_max_level).rgb;
}
