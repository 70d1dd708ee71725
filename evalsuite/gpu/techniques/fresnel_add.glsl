vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    float fresnel = fresnel_dielectric(dot(s.normal, s.to_view), eta.x);
    vec3 mirror = specular_reflectance * textureLod(env_cube, r, 0.0).rgb;
    return fresnel * mirror + diffuse_reflectance / PI * irradiance(s.normal);
}
