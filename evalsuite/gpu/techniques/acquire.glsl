// The probe's cubemap and its SH coefficients, drawn for this very frame: diffuse as in diffuse-sh9, glossy as in
// glossy-mcguire.
vec3 shade(Surface s) {
    vec3 glossy = textureLod(env_cube, reflect(-s.to_view, s.normal), exponent_to_lod(exponent, env_face_size)).rgb;
    return diffuse_reflectance / PI * irradiance(s.normal) + specular_reflectance * glossy;
}
