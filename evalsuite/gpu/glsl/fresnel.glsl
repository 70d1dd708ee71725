// math.fresnel.fresnel_conductor, per channel.
vec3 fresnel_conductor(float cosine, vec3 eta, vec3 k) {
    float c = clamp(cosine, 0.0, 1.0);
    float s2 = 1.0 - c * c;
    vec3 difference = eta * eta - k * k - s2;
    vec3 a2b2 = sqrt(difference * difference + 4.0 * eta * eta * k * k);
    // The second form where the first would cancel: GPUs' square roots are not exact.
    vec3 a2 = mix(0.5 * (a2b2 + difference), 2.0 * eta * eta * k * k / (a2b2 - difference), lessThan(difference, vec3(0.0)));
    vec3 a = sqrt(max(vec3(0.0), a2));
    vec3 r_s = (a2b2 + c * c - 2.0 * a * c) / (a2b2 + c * c + 2.0 * a * c);
    vec3 r_p = r_s * (c * c * a2b2 + s2 * s2 - 2.0 * a * c * s2) / (c * c * a2b2 + s2 * s2 + 2.0 * a * c * s2);
    return 0.5 * (r_s + r_p);
}
