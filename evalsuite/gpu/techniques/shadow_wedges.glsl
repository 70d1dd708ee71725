#if LIGHTS > 0
uniform sampler2DArray visibility;  // of each light's disc, in this pixel
#endif

vec3 shade(Surface s) {
    vec3 radiance = ambient(s);
#if LIGHTS > 0
    for (int i = 0; i < LIGHTS; ++i)
        radiance += texelFetch(visibility, ivec3(gl_FragCoord.xy, i), 0).r * light_irradiance[i] * reflected(s, light_direction[i]);
#endif
    return radiance;
}
