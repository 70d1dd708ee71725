uniform float bias;
uniform vec3 fresnel_normal;

vec3 shade(Surface s) {
    vec3 r = reflect(-s.to_view, s.normal);
    vec3 fresnel = fresnel_schlick(dot(s.normal, r), fresnel_normal);
    vec3 glossy = specular_reflectance * texture(env_cube, r, bias).rgb;
    return (1.0 - fresnel) * diffuse_reflectance / PI * irradiance(s.normal) + fresnel * glossy;
}
