// math.fresnel.fresnel_dielectric: unpolarised reflectance of a smooth dielectric of relative index n.
float fresnel_dielectric(float cosine, float n) {
    float c = clamp(cosine, 0.0, 1.0);
    float g2 = n * n + c * c - 1.0;
    if (g2 <= 0.0 && n < 1.0) return 1.0;
    float total = max(sqrt(max(g2, 0.0)) + c, 1e-15);
    float difference = (n * n - 1.0) / total;
    float root_s = difference / total;
    float ratio = (c * total - 1.0) / (c * difference + 1.0);
    return 0.5 * root_s * root_s * (1.0 + ratio * ratio);
}

// math.fresnel.fresnel_schlick.
vec3 fresnel_schlick(float cosine, vec3 normal_reflectance) {
    float grazing = 1.0 - clamp(cosine, 0.0, 1.0);
    return normal_reflectance + (1.0 - normal_reflectance) * pow(grazing, 5.0);
}
