vec3 shade(Surface surface) {
    vec3 r = reflect(-surface.to_view, surface.normal);
    vec3 fresnel = fresnel_conductor(dot(surface.normal, surface.to_view), eta, k);  // 1 for Phong and Blinn-Phong
    return fresnel * specular_reflectance * textureLod(env_cube, r, exponent_to_lod(exponent, env_face_size)).rgb;
}
