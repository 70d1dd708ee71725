#if BATCH > 0
uniform vec3 sample_irradiance[BATCH];  // at normal incidence, times the number of rounds
uniform int sample_count;
#endif

vec3 shade(Surface s) {
    vec3 radiance = vec3(0.0);
#if AMBIENT
    radiance = ambient(s);
#endif
#if BATCH > 0
    vec3 plane = geometric_normal(s);
    for (int i = 0; i < sample_count; ++i) {
        if (dot(s.normal, map_to_light[i]) <= 0.0) continue;
        Receiver r = receiver(i, s.position, plane);
        if (blocker(i, r, r.at) < 1e30) continue;
        radiance += sample_irradiance[i] * reflected(s, map_to_light[i]);
    }
#endif
    return radiance;
}
