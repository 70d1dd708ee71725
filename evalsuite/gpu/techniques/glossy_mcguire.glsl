uniform float lod_offset;  // 0 as published

vec3 shade(Surface surface) {
    vec3 r = reflect(-surface.to_view, surface.normal);
    vec3 fresnel = fresnel_conductor(dot(surface.normal, surface.to_view), eta, k);  // 1 for Phong and Blinn-Phong
    float level = exponent_to_lod(exponent, env_face_size) + lod_offset;
    return fresnel * specular_reflectance * textureLod(env_cube, r, level).rgb;
}
