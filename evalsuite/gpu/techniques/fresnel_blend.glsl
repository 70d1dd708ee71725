// 1 where light that the surface reflects is lost to the Lambert part below, 0 where the parts are simply added.
uniform float coat;

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    float fresnel = fresnel_dielectric(dot(s.normal, s.to_view), eta.x);
    vec3 mirror = specular_reflectance * textureLod(env_cube, r, 0.0).rgb;
    return fresnel * mirror + (1.0 - coat * fresnel) * diffuse_reflectance / PI * irradiance(s.normal);
}
