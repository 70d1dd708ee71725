uniform samplerCube prefiltered;   // level k: GGX of roughness √α = k/(levels − 1), for n = v = r
uniform sampler2D brdf_table;      // at (n·v, √α): A, B
uniform float prefiltered_levels;
uniform float alpha;

vec3 shade(Surface s) {
    float n_v = max(dot(s.normal, s.to_view), 0.0), roughness = sqrt(alpha);
    vec3 r = reflect(-s.to_view, s.normal);
    vec3 radiance = textureLod(prefiltered, r, roughness * (prefiltered_levels - 1.0)).rgb;
    vec2 ab = textureLod(brdf_table, vec2(n_v, roughness), 0.0).rg;
    return specular_reflectance * radiance * (fresnel_conductor(1.0, eta, k) * ab.x + ab.y);
}
