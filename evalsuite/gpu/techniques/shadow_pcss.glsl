#if BATCH > 0
uniform float light_tan[BATCH];  // of the angular radius
uniform float turn;              // of the taps, another in each pass

// Points spread evenly over the unit disc, on Vogel's spiral.
vec2 tap(int k, float count, float start) {
    float angle = start + 2.399963229728653 * float(k);  // the golden angle
    return sqrt((float(k) + 0.5) / count) * vec2(cos(angle), sin(angle));
}

// Visible part of light i's disc: by similar triangles from the mean depth of what is found before the receiver, then the part of
// that penumbra's disc in which nothing is.
float visible_part(int i, Surface s, vec3 plane, float start) {
    Receiver r = receiver(i, s.position, plane);
    vec2 reach = max(r.depth - map_nearest[i], 0.0) * light_tan[i] / map_texel[i];
    float sum = 0.0, found = 0.0;
    for (int k = 0; k < BLOCKER_TAPS; ++k) {
        float depth = blocker(i, r, r.at + reach * tap(k, float(BLOCKER_TAPS), start));
        if (depth < 1e30) {
            sum += depth;
            found += 1.0;
        }
    }
    if (found == 0.0) return 1.0;
    vec2 width = max(r.depth - sum / found, 0.0) * light_tan[i] / map_texel[i];
    float lit = 0.0;
    for (int k = 0; k < FILTER_TAPS; ++k)
        lit += blocker(i, r, r.at + width * tap(k, float(FILTER_TAPS), start)) < 1e30 ? 0.0 : 1.0;
    return lit / float(FILTER_TAPS);
}
#endif

vec3 shade(Surface s) {
    vec3 radiance = ambient(s);
#if BATCH > 0
    vec3 plane = geometric_normal(s);
    // A pattern of its own in each pixel: what is left of the taps is noise, not bands.
    float start = 6.283185307 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) + turn;
    for (int i = 0; i < BATCH; ++i) {
        vec3 light = reflected(s, light_direction[i]);
        if (light == vec3(0.0)) continue;
        radiance += visible_part(i, s, plane, start) * light_irradiance[i] * light;
    }
#endif
    return radiance;
}
