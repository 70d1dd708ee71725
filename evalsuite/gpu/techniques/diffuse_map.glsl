uniform samplerCube diffuse_map;  // gpu.prefilter.lobe_map with N = 1: E/π

vec3 shade(Surface s) {
    return diffuse_reflectance * textureLod(diffuse_map, s.normal, 0.0).rgb;
}
