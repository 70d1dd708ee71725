vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
#ifdef HARDWARE_LOD
    vec3 radiance = texture(env_cube, r).rgb;
#else
    vec3 radiance = textureLod(env_cube, r, 0.0).rgb;
#endif
    return fresnel_conductor(dot(s.normal, s.to_view), eta, k) * specular_reflectance * radiance;
}
