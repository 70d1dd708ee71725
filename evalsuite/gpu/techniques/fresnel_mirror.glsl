vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    float fresnel = fresnel_dielectric(dot(s.normal, s.to_view), eta.x);
    return fresnel * specular_reflectance * textureLod(env_cube, r, 0.0).rgb;
}
