// library/paraboloid.glsl's maps, prefiltered: gpu.prefilter.hierarchical.
vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    vec3 front = textureLod(front_map, paraboloid_coordinates(front_matrix, r), 0.0).rgb;
    vec3 back = textureLod(back_map, paraboloid_coordinates(back_matrix, r), 0.0).rgb;
    return specular_reflectance * (r.z >= 0.0 ? front : back);
}
