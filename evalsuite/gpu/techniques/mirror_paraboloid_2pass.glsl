// One pass a map; the alpha test leaves out what lies beyond its circle and ring.
vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
#if HEMISPHERE == 0
    vec4 texel = paraboloid_texel(front_map, front_matrix, r);
#else
    vec4 texel = paraboloid_texel(back_map, back_matrix, r);
#endif
    if (texel.a < 254.5 / 255.0) discard;  // EQUAL 1.0 in the papers' 8 bits
    return fresnel_conductor(dot(s.normal, s.to_view), eta, k) * specular_reflectance * texel.rgb;
}
