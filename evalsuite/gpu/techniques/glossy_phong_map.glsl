uniform samplerCube phong_map;  // gpu.prefilter.lobe_map

vec3 shade(Surface s) {
    return specular_reflectance * textureLod(phong_map, reflect(-s.to_view, s.normal), 0.0).rgb;
}
