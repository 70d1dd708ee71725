vec3 shade(Surface s) {
    return diffuse_reflectance / PI * irradiance(s.normal);  // of windowed coefficients
}
