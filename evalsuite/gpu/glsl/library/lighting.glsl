// LIGHTS area lights at infinity, shaded from their centres, and the prefiltered rest: gpu.shadow.lighting.
#if LIGHTS > 0
uniform vec3 light_direction[LIGHTS];   // world, unit, to the centre
uniform vec3 light_irradiance[LIGHTS];  // of all its radiance at normal incidence
#endif
uniform bool phong_lobe;
uniform samplerCube ambient_diffuse;  // E/π about n
uniform samplerCube ambient_glossy;   // normalised Phong lobe about r

// Reflected radiance of the unshadowed rest.
vec3 ambient(Surface s) {
    vec3 radiance = diffuse_reflectance * texture(ambient_diffuse, s.normal).rgb;
    if (phong_lobe) radiance += specular_reflectance * texture(ambient_glossy, reflect(-s.to_view, s.normal)).rgb;
    return radiance;
}

// f(l, v) (n·l)₊, math.phong: with irradiance at normal incidence it gives the radiance that light from l leaves towards v.
vec3 reflected(Surface s, vec3 to_light) {
    float cosine = dot(s.normal, to_light);
    if (cosine <= 0.0) return vec3(0.0);
    vec3 value = diffuse_reflectance * (cosine / PI);
    if (phong_lobe) {
        float lobe = pow(max(dot(reflect(-s.to_view, s.normal), to_light), 0.0), exponent);
        value += specular_reflectance * ((exponent + 1.0) / (2.0 * PI) * lobe);
    }
    return value;
}
