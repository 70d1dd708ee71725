vec3 shade_vertex(vec3 normal) {
#ifdef PER_VERTEX
    return irradiance(normalize(normal));
#else
    return vec3(0.0);
#endif
}

vec3 shade(Surface s) {
#ifdef PER_VERTEX
    return diffuse_reflectance / PI * s.vertex_value;
#else
    return diffuse_reflectance / PI * irradiance(s.normal);
#endif
}
