// The front map blended over the back one by its own alpha: math.paraboloid has the matrices P·S·M⁻¹.
vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    vec4 front = paraboloid_texel(front_map, front_matrix, r);
    vec4 back = paraboloid_texel(back_map, back_matrix, r);
    vec3 radiance = mix(back.rgb, front.rgb, front.a);
    return fresnel_conductor(dot(s.normal, s.to_view), eta, k) * specular_reflectance * radiance;
}
