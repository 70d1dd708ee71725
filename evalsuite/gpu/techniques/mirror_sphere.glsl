uniform sampler2D sphere_map;
uniform mat3 world_to_map;     // rows right, up, v₀
uniform float sphere_scale;    // radius of the disc over the map's width

// math.sphere_map.direction_to_disc
vec2 direction_to_disc(vec3 d) {
    float side = length(d.xy);
    if (d.z > 0.0) return d.xy / sqrt(2.0 * (1.0 + d.z));
    return side > 0.0 ? sqrt(0.5 * (1.0 - d.z)) * d.xy / side : vec2(0.0, -1.0);
}

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    vec2 st = 0.5 + sphere_scale * direction_to_disc(world_to_map * r);
    vec3 radiance = textureLod(sphere_map, st, 0.0).rgb;
    return fresnel_conductor(dot(s.normal, s.to_view), eta, k) * specular_reflectance * radiance;
}
