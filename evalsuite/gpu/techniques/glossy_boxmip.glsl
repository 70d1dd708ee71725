uniform float bias;

vec3 shade(Surface s) {
    return specular_reflectance * texture(env_cube, reflect(-s.to_view, s.normal), bias).rgb;
}
